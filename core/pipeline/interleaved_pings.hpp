// Pictures whose neighbouring beams come from successive pings (docs/acoustics.md, section 6): the requests of these pings, and
// the picture that they make.
#pragma once

#include <span>
#include <vector>

#include "core/sonar/ping.hpp"

namespace sonar {

/// How many pings a picture is made of; the request is valid.
int pings_in(const PingRequest& picture);
/// Its pings, the first first, each when and where it is fired. Their numbers, which key the noise, are their own.
std::vector<PingRequest> pings_of(const PingRequest& picture);
/// The picture, with its own request: every beam as its ping found it. `pings`: of pings_of(), in their order.
Ping interleaved(const PingRequest& picture, std::span<Ping> pings);

}  // namespace sonar
