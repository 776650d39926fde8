// Where the vehicle of a rendered ping is: at rest, on the demo's circle, or on the way that a file of poses describes.
// World ENU, body FLU; between the lines of a file straight on and evenly turning.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/geometry.hpp"
#include "core/base/result.hpp"
#include "core/sonar/ping.hpp"

namespace sonar::render {

struct TimedPose {
  double time_s = 0;
  Pose body_in_world;
};

struct VehiclePath {
  Pose initial;                  // without poses
  bool orbits = false;           // circles the world's z axis, as `trajectory: orbit`
  std::vector<TimedPose> poses;  // times rise; empty = none
};

Pose vehicle_at(const VehiclePath& path, double time_s);
/// How the sonar on its mount moves from then on: the difference of two poses a millisecond apart.
Twist sonar_twist_at(const VehiclePath& path, const Pose& mount, double time_s);

enum class PoseFrame { enu_flu, ned_frd };

/// CSV whose first line names its columns: t or t_s; x, y, z (or x_m, ...); and qw, qx, qy, qz, or roll_deg, pitch_deg, yaw_deg
/// (intrinsic Z-Y-X; absent = 0). Or TUM: t x y z qx qy qz qw, blanks between. Lines that begin with # are comments;
/// `# frame: NED_FRD` or `# frame: ENU_FLU` tells the frame. `asked` wins where the file says nothing.
/// Errors: name:line: what.
Result<std::vector<TimedPose>> parse_poses(std::string_view text, const std::string& name, PoseFrame asked = PoseFrame::enu_flu);
Result<std::vector<TimedPose>> load_poses(const std::filesystem::path& file, PoseFrame asked = PoseFrame::enu_flu);

}  // namespace sonar::render
