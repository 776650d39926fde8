// Effects of faults of the stage payload on the samples of a ping. Pure functions.
#pragma once

#include "core/sonar/ping.hpp"
#include "daemon/config/faults/fault.hpp"
#include "daemon/emulator/faults/draws.hpp"

namespace sonar {

/// `kept`: the ping that the effect `stuck` repeats, or null. `begun`: number of pings since the fault began, 0 for the first.
void alter_ping(const Fault& fault, const FaultDraws& draws, const Ping* kept, std::uint64_t begun, Ping& ping);

}  // namespace sonar
