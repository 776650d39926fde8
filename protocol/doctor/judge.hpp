// Determines from the daemon's status why a driver gets no pings; each check adds findings. (`sonarctl doctor` checks from
// outside, as a driver would.)
#pragma once

#include <string>
#include <vector>

#include "protocol/doctor/socket_table.hpp"

namespace sonar::v1 {  // from control.pb.h
class DaemonStatus;
}  // namespace sonar::v1
namespace sonar::doctor {

// Checks a daemon's status, for sonarctl and the daemon.

// A finding of doctor: a part that works, or a fault with its cause and a remedy. `sonarctl doctor` makes findings from outside;
// the daemon makes findings for the live view.

enum class Level { ok, warn, fail };
struct Finding {
  Level level = Level::ok;
  std::string check;  // name of the check, for programs: "status", "ping", "rate", "ports", ...
  std::string text;
  std::string cure;         // empty for Level::ok
  std::string sonar = {};   // name of the sonar; empty = none
  std::string client = {};  // address of the client; empty = none
};

inline constexpr const char* less_to_compute =
    "fewer beams, less range, more threads (engine.threads), or fewer other programs on this computer";
inline constexpr const char* free_a_place = "stop the other client, or raise clients.max of the sonar";

/// Returns a text such as "computing takes 138 ms per ping: 7.2 Hz at most here".
std::string computing_text(double ms_per_ping);

/// Adds findings for arriving and stopped poses of each vehicle, for notes, and for refused poses.
void check_poses(const v1::DaemonStatus& status, std::vector<Finding>& findings);

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
