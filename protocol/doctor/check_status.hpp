// Checks of a status, and their texts, shared by sonarctl and the daemon. Pure.
#pragma once

#include <string>
#include <vector>

#include "protocol/doctor/finding.hpp"

namespace sonar::v1 {  // from control.pb.h
class DaemonStatus;
}  // namespace sonar::v1

namespace sonar::doctor {

inline constexpr const char* less_to_compute =
    "fewer beams, less range, more threads (engine.threads), or fewer other programs on this computer";
inline constexpr const char* free_a_place = "stop the other client, or raise clients.max of the sonar";

/// A text such as "computing takes 138 ms per ping: 7.2 Hz at most here".
std::string computing_text(double ms_per_ping);

/// Adds findings for arriving and stopped poses of each vehicle, for notes, and for refused poses.
void check_poses(const v1::DaemonStatus& status, std::vector<Finding>& findings);

}  // namespace sonar::doctor
