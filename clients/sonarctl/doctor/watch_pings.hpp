// Connects to one sonar as a driver would, and measures delay, size, rate and latency of its pings.
#pragma once

#include "clients/sonarctl/control_client.hpp"
#include "clients/sonarctl/doctor/probes.hpp"

namespace sonar::clients::doctor {

/// Connects, requests pings unless another client is connected, reads about 15 of them and disconnects. `control`: a client
/// subscribed to pings, for transmission times; may be null. `clocks` is set to the difference of the clocks.
void watch_pings(SonarFacts& sonar, ControlClient* control, Steady::time_point deadline, ControlFacts& clocks);

}  // namespace sonar::clients::doctor
