// Finds out why a driver gets no pings, from the daemon's status alone: one finding per check. sonarctl doctor checks from
// outside, as a driver would. Pure.
#pragma once

#include <vector>

#include "protocol/doctor/check_status.hpp"
#include "protocol/doctor/socket_table.hpp"

namespace sonar::doctor {

/// Connection attempts of programs on the daemon's computer: they show a driver on a wrong address. Read only while
/// looks_elsewhere().
struct Elsewhere {
  std::vector<SocketLine> tcp;
  std::uint64_t refused = 0;  // connections, in the last seconds
};

/// An active fault first, then the worst first. `before`: a status of about two seconds earlier, for what changes with time;
/// null = none.
std::vector<Finding> judge(const v1::DaemonStatus& now, const v1::DaemonStatus* before, const Elsewhere& elsewhere = {});

/// Whether drivers at wrong addresses are searched for: none is connected, and no fault acts that may refuse connections at the
/// right address.
bool looks_elsewhere(const v1::DaemonStatus& status);

}  // namespace sonar::doctor
