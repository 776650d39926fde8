#include "daemon/emulator/world/body_axes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>

#include "core/text/format.hpp"

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
  constexpr double leaning = 0.3;  // small, because cameras may point steeply down
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

namespace {

using Direction = std::complex<double>;

constexpr double largest_as_rad = 2 * pi;       // angles are -pi to pi, or 0 to 2 pi
constexpr std::size_t least_steps = 20;         // steps of the path; fewer prove nothing
constexpr double least_step_m = 1e-3;           // a shorter step has no direction
constexpr double agrees = 0.97, differs = 0.7;  // length of the mean of unit vectors: 1 if all are equal, 0 if evenly spread
constexpr double most_short_of_turn_deg = 0.3;  // a jump from pi to -pi is shorter than a turn by at most this
constexpr double steady_deg = 0.3;              // largest turn of other steps; if they are radians, 17 deg

double heading_deg(const Pose& pose) { return deg_from_rad(rpy_from_quat(pose.orientation).yaw_rad); }
double without_turns_deg(double angle_deg) { return std::remainder(angle_deg, 360); }
double length_of_mean(Direction sum, std::size_t count) { return std::abs(sum) / static_cast<double>(count); }

/// True if the course turns, the heading does not follow it, and the heading multiplied by 57.3 would follow it.
bool follows_course_as_radians(const std::vector<Pose>& poses, const std::vector<double>& turned_deg) {
  Direction as_read, as_radians, courses;
  std::size_t steps = 0;
  for (std::size_t i = 1; i < poses.size(); ++i) {
    const Vec3d moved_m = poses[i].position_m - poses[i - 1].position_m;
    const double step_m = std::hypot(moved_m.x, moved_m.y);
    if (step_m < least_step_m) continue;
    const double course_rad = std::atan2(moved_m.y, moved_m.x), heading = turned_deg[i - 1];
    courses += std::polar(1.0, course_rad);
    as_read += std::polar(1.0, course_rad - rad_from_deg(heading));
    as_radians += std::polar(1.0, course_rad - heading);
    ++steps;
  }
  return steps >= least_steps && length_of_mean(courses, steps) < differs && length_of_mean(as_read, steps) < differs &&
         length_of_mean(as_radians, steps) > agrees;
}

/// True if the angles stay within one turn of 2 pi, and jump from one end of that range to the other.
bool jumps_by_two_pi(const std::vector<double>& turned_deg) {
  std::size_t jumps = 0;
  for (std::size_t i = 1; i < turned_deg.size(); ++i) {
    const double step = std::abs(turned_deg[i] - turned_deg[i - 1]);
    const bool is_jump = step <= largest_as_rad + 1e-6 && step > largest_as_rad - most_short_of_turn_deg;
    if (!is_jump && step > steady_deg) return false;
    jumps += is_jump ? 1 : 0;
  }
  const auto [low, high] = std::minmax_element(turned_deg.begin(), turned_deg.end());
  return jumps > 0 && turned_deg.size() > least_steps && *high - *low <= largest_as_rad + 1e-6;
}

}  // namespace

std::optional<std::string> radians_read_as_degrees(const std::vector<Pose>& poses) {
  if (poses.size() <= least_steps) return std::nullopt;
  // Headings are relative to the first pose, so that the frame of the file does not matter.
  std::vector<double> turned_deg;
  for (const Pose& p : poses) {
    turned_deg.push_back(without_turns_deg(heading_deg(p) - heading_deg(poses.front())));
    if (std::abs(turned_deg.back()) > largest_as_rad + 1e-6) return std::nullopt;
  }
  const auto [low, high] = std::minmax_element(turned_deg.begin(), turned_deg.end());
  const std::string range = text::format("stay within %.1f deg, ", *high - *low);
  if (follows_course_as_radians(poses, turned_deg)) return range + "and would follow the course if they were radians";
  if (jumps_by_two_pi(turned_deg)) return range + "and jump by 6.28 deg, as radians do after a whole turn";
  return std::nullopt;
}

}  // namespace sonar
