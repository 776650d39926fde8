// Signals that receive channels share, with opposite signs in neighbours: noise, and in some receivers the transmitter's leak.
// They appear as wide grains and fringes in pictures of an array that is focused at every range (docs/acoustics.md, section 5).
#pragma once

#include <string>

#include "core/sonar/ping.hpp"

namespace sonar {

/// Why the numbers of channels and of a group's channels are invalid; empty = they are valid.
std::string why_impossible(const SharedNoise& law);
/// Why SharedNoiseTable would need too much memory or time; empty if it does not. Needs valid numbers of channels.
std::string why_table_too_large(const FrequencyMode& mode, const PingSettings& settings, const Switches& switches);

}  // namespace sonar
