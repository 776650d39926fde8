#include "daemon/emulator/world/body_axes.hpp"

#include <algorithm>
#include <array>

namespace sonar {
namespace {

constexpr const char* camera_cure =
    "mount its sonars with rpy_deg: [0, -90, 90], which turns a camera's axes to ours (x ahead, y left, z up); if no camera "
    "wrote the file, check the order of the quaternion (TUM: w last; EuRoC: w first)";
constexpr const char* camera_imu_cure =
    "mount its sonars with rpy_deg: [0, -90, 180], which turns these axes to ours (x ahead, y left, z up); if the axes are "
    "others, check the order of the quaternion (TUM: w last; EuRoC: w first)";

constexpr std::array<OtherAxes, 2> other_axes{
    {{"have the axes of a camera: x right, y down, z ahead", camera_cure, {0, -1, 0}},
     {"have the axes of an IMU beside a camera: x up, z ahead", camera_imu_cure, {1, 0, 0}}}};

}  // namespace

const OtherAxes* axes_of(const std::vector<Pose>& poses) {
  constexpr double leaning = 0.3;  // cameras may look steeply down
  std::vector<Quatd> lying;
  for (const Pose& p : poses)
    if (upright(p.orientation) < tilted) lying.push_back(p.orientation);
  if (lying.empty() || 2 * lying.size() < poses.size()) return nullptr;
  for (const OtherAxes& axes : other_axes) {
    const auto is_up = [&](Quatd q) { return rotate(q, axes.up).z > leaning; };
    if (10 * static_cast<std::size_t>(std::count_if(lying.begin(), lying.end(), is_up)) >= 9 * lying.size()) return &axes;
  }
  return nullptr;
}

bool are_upright(const std::vector<Pose>& mounts, const OtherAxes& axes) {
  return !mounts.empty() && std::all_of(mounts.begin(), mounts.end(), [&](const Pose& mount) {
    return dot(rotate(mount.orientation, Vec3d{0, 0, 1}), axes.up) > tilted;
  });
}

}  // namespace sonar
