// The Teledyne BlueView products as SonarModel rows, one frequency mode per head, and the default settings of a head.
// `HeadPreset::verified` marks the heads whose main figures have a source (protocol/blueview/README.md); other figures are
// recalled.
#pragma once

#include <memory>
#include <span>
#include <string_view>

#include "core/sonar/sonar_model.hpp"

namespace sonar::blueview {

/// Values of one head in addition to its FrequencyMode.
struct HeadPreset {
  int beams = 512;
  double bin_m = 0.0254;  // range resolution
  double start_m = 2, stop_m = 10;
  bool verified = false;  // true: checked against an accessible source; false: from memory of data sheets
};

std::span<const std::shared_ptr<const SonarModel>> models();
/// Returns one preset per frequency mode of the model.
std::span<const HeadPreset> head_presets(std::string_view profile);

}  // namespace sonar::blueview
