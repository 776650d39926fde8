// Connects to one sonar as a driver would and measures delay, size, rate and latency of its pings. Used by gather.
#pragma once

#include "clients/sonarctl/control_client.hpp"
#include "clients/sonarctl/doctor/probes.hpp"

namespace sonar::clients::doctor {

/// Connects, requests pings unless another client is connected, reads about 15 of them and disconnects. `control`: subscribed to
/// pings, or null; source of the transmission times. A difference of the clocks goes to `clocks`.
void watch_pings(SonarFacts& sonar, ControlClient* control, Steady::time_point deadline, ControlFacts& clocks);

}  // namespace sonar::clients::doctor
