// Checks a daemon's status, for sonarctl and the daemon.
#pragma once

#include <string>
#include <vector>

namespace sonar::v1 {  // from control.pb.h
class DaemonStatus;
}  // namespace sonar::v1
namespace sonar::doctor {

// A finding of doctor: a part that works, or a fault with its cause and a remedy. `sonarctl doctor` makes findings from outside;
// the daemon makes findings for the live view (judge.hpp).

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

}  // namespace sonar::doctor
