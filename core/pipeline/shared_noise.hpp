// Signals that receive channels share, with opposite signs in neighbouring channels: noise, and in some receivers the
// transmitter's leak. In pictures of an array that is focused at every range, these signals appear as wide grains and fringes
// (docs/acoustics.md, section 5).
#pragma once

#include <string>

#include "core/sonar/ping.hpp"

namespace sonar {

/// The reason why the numbers of channels and of channels in a group are invalid; empty if they are valid.
std::string why_impossible(const SharedNoise& law);
/// The reason if SharedNoiseTable would need too much memory or time; else empty. The numbers of channels must be valid.
std::string why_table_too_large(const FrequencyMode& mode, const PingSettings& settings, const Switches& switches);

}  // namespace sonar
