// Determines from the daemon's status why a driver gets no pings; each check adds findings. (`sonarctl doctor` checks from
// outside, as a driver would.)
#pragma once

#include <vector>

#include "protocol/doctor/check_status.hpp"
#include "protocol/doctor/socket_table.hpp"

namespace sonar::doctor {

/// Connection attempts of programs on the daemon's computer: evidence of a driver with a wrong address. Used only while
/// looks_elsewhere().
struct Elsewhere {
  std::vector<SocketLine> tcp;
  std::uint64_t refused = 0;  // number of connections that failed in the last seconds
};

/// Returns active faults first, then the other findings, worst first. `before`: a status from about two seconds earlier, for
/// changes with time; null = none.
std::vector<Finding> judge(const v1::DaemonStatus& now, const v1::DaemonStatus* before, const Elsewhere& elsewhere = {});

/// True if a search for drivers with wrong addresses is useful: no driver is connected, and no active fault may refuse
/// connections at the right address.
bool looks_elsewhere(const v1::DaemonStatus& status);

}  // namespace sonar::doctor
