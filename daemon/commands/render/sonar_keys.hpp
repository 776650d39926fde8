// Reads the keys `model:` and `ping:` of a render file: the parameters of a product, and the settings that its client would send.
// Values without a key stay as they are.
#pragma once

#include "core/sonar/ping_settings.hpp"
#include "core/sonar/sonar_model.hpp"
#include "core/text/strict_yaml.hpp"

namespace sonar::render {

void read_model(text::Map keys, FrequencyMode& mode);

/// How missing rows and pulse are derived from the range.
enum class RowsOf {
  no_device,    // row spacing follows the pulse: the sampling rate is 2 b (docs/acoustics.md, section 4)
  device,       // rows and pulse are proportional to the range
  range_image,  // rows are elevations and the pulse is the range cell of the product; neither depends on the range
};
/// Reads the keys of a sonar with this model.
void read_ping(text::Map keys, const SonarModel& model, RowsOf rows_of, PingSettings& settings);
/// Reads `mode:` of a ping, a name or a number from 1. The returned mode and `fallback` count from 0.
int read_mode(const text::Node& node, const SonarModel& model, int fallback);

}  // namespace sonar::render
