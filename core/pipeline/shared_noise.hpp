// Signals that receive channels share, with opposite signs in neighbours: noise, and in some receivers the transmitter's leak. An
// array that is focused at every range turns them into wide grains and fringes (docs/acoustics.md, section 5).
#pragma once

#include <string>

#include "core/sonar/ping.hpp"

namespace sonar {

/// The fault of the numbers of channels and of a group; empty for valid ones.
std::string why_impossible(const SharedNoise& law);
/// Why SharedNoiseTable would need too much memory or time; empty if it does not. Needs possible numbers of channels.
std::string why_table_too_large(const FrequencyMode& mode, const PingSettings& settings, const Switches& switches);

}  // namespace sonar
