// A short look at one sonar's pings, as a driver would connect: how soon, what, how often, how late. Used by gather.
#pragma once

#include "clients/sonarctl/control/control_client.hpp"
#include "clients/sonarctl/doctor/probes.hpp"

namespace sonar::clients::doctor {

/// Connects, asks for pings unless somebody else is connected, reads a dozen of them and leaves. `control`: subscribed to pings,
/// or null; tells when each was fired. A difference of the clocks goes to `clocks`.
void watch_pings(SonarFacts& sonar, ControlClient* control, Steady::time_point deadline, ControlFacts& clocks);

}  // namespace sonar::clients::doctor
