// The Sonar 3D-15 as a SonarModel with two modes, and the constants of its images. Sources: docs/protocols/waterlinked.md.
#pragma once

#include <memory>
#include <span>

#include "core/sonar/sonar_model.hpp"

namespace sonar::waterlinked {

inline constexpr int columns = 256, rows = 64;
inline constexpr double longest_range_m = 15, least_window_m = 0.1, pixel_scale_m = 50.0 / 65536;
inline constexpr std::uint32_t full_scale_strength = 400;  // linear; the assisted gain keeps 99 % of the pixels below 80 % of it

/// Values in which the modes differ, beside FrequencyMode.
struct ModeRow {
  const char* name = "";  // as the HTTP API has it
  double centre_hz = 0, horizontal_deg = 0, vertical_deg = 0, beam_deg = 0, range_cell_m = 0;
  float rate_hz = 0;
};
std::span<const ModeRow> mode_rows();
std::span<const std::shared_ptr<const SonarModel>> models();

}  // namespace sonar::waterlinked
