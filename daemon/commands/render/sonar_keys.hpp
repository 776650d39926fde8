// The keys `model:` and `ping:` of a render file: the parameters of a product and the settings of its client.
// Keys that are not given keep their values.
#pragma once

#include <optional>

#include "core/sonar/ping_settings.hpp"
#include "core/sonar/sonar_model.hpp"
#include "core/text/strict_yaml.hpp"

namespace sonar::render {

void read_model(text::Map keys, FrequencyMode& mode);

/// Keys of a sonar with that model. `own_grid`: the settings come from no device; rows then follow the pulse, two samples to its
/// b (docs/acoustics.md, section 4), unless they are given.
void read_ping(text::Map keys, const SonarModel& model, bool own_grid, PingSettings& settings);
/// `mode:` of a ping, a name or a number from 1; `fallback` counts from 0.
int read_mode(const text::Node& node, const SonarModel& model, int fallback);

}  // namespace sonar::render
