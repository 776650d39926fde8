// Checks whether a request can be simulated. Every engine calls it before a ping.
#pragma once

#include <string>

#include "core/sonar/ping.hpp"

namespace sonar {

/// Returns the reason, one sentence, why a request cannot be simulated; empty if it can be simulated.
std::string why_invalid(const PingRequest& request);

}  // namespace sonar
