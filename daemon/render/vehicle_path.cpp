#include "daemon/render/vehicle_path.hpp"

#include <algorithm>

#include "daemon/pose_history.hpp"
#include "daemon/world.hpp"

namespace sonar::render {
namespace {

constexpr double twist_step_s = 1e-3;

Pose on_circle(const Pose& initial, double time_s) {
  const World world({}, {{"vehicle", initial, true}}, {}, Time{});
  return world.vehicle_at(0, Time{} + nanoseconds_from(time_s));
}

Pose between(const std::vector<TimedPose>& poses, double time_s) {
  const auto after =
      std::lower_bound(poses.begin(), poses.end(), time_s, [](const TimedPose& p, double t) { return p.time_s < t; });
  if (after == poses.end()) return poses.back().body_in_world;
  if (after == poses.begin() || after->time_s == time_s) return after->body_in_world;
  const TimedPose &a = *(after - 1), &b = *after;
  const double u = (time_s - a.time_s) / (b.time_s - a.time_s);
  const Vec3d way = b.body_in_world.position_m - a.body_in_world.position_m;
  return {a.body_in_world.position_m + u * way, slerp(a.body_in_world.orientation, b.body_in_world.orientation, u)};
}

}  // namespace

Pose vehicle_at(const VehiclePath& path, double time_s) {
  if (!path.poses.empty()) return between(path.poses, time_s);
  return path.orbits ? on_circle(path.initial, time_s) : path.initial;
}

Twist sonar_twist_at(const VehiclePath& path, const Pose& mount, double time_s) {
  const bool ends = !path.poses.empty() && time_s + twist_step_s > path.poses.back().time_s;  // look back instead
  const double from_s = ends ? time_s - twist_step_s : time_s;
  const Pose a = compose(vehicle_at(path, from_s), mount), b = compose(vehicle_at(path, from_s + twist_step_s), mount);
  return {(1 / twist_step_s) * (b.position_m - a.position_m),
          (1 / twist_step_s) * rotation_between(a.orientation, b.orientation)};
}

}  // namespace sonar::render
