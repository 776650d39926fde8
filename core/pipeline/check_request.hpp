// Checks whether a request can be simulated. Every engine calls it before a ping.
#pragma once

#include <string>

#include "core/sonar/ping.hpp"

namespace sonar {

/// A sentence with the reason why a request cannot be simulated; empty if it can.
std::string why_invalid(const PingRequest& request);

}  // namespace sonar
