// Pictures whose neighbouring beams come from successive pings (docs/acoustics.md, section 6): the requests of these pings, and
// the picture that they make.
#pragma once

#include <span>
#include <vector>

#include "core/sonar/ping.hpp"

namespace sonar {

/// Number of pings in a picture. The request must be valid.
int pings_in(const PingRequest& picture);
/// The requests of a picture's pings in the order of firing, each with its own time, pose, and number, which is a key of the
/// noise.
std::vector<PingRequest> pings_of(const PingRequest& picture);
/// The picture, with its own request; each beam is from its ping. `pings` are the results of pings_of(), in the same order.
Ping interleaved(const PingRequest& picture, std::span<Ping> pings);

}  // namespace sonar
