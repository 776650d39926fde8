#include "daemon/commands/render/vehicle_path.hpp"

#include <algorithm>

#include "core/motion/jump.hpp"
#include "core/text/format.hpp"
#include "daemon/emulator/world/world.hpp"

namespace sonar::render {
namespace {

World circling(const Pose& initial) { return World({}, {{"vehicle", initial, true}}, {}, Time{}); }

/// Without the poses that follow another in less than `shortest_step`; the last one stays where it is the only other.
motion::Trajectory thinned(const motion::Points& all) {
  motion::Points kept;
  for (std::size_t i = 0; i < all.times.size(); ++i) {
    const bool is_far = kept.times.empty() || all.times[i] - kept.times.back() >= shortest_step;
    if (!is_far && (i + 1 < all.times.size() || kept.times.size() > 1)) continue;
    kept.times.push_back(all.times[i]);
    kept.poses.push_back(all.poses[i]);
  }
  return motion::Trajectory(std::move(kept));
}

}  // namespace

Steps steps_of(const motion::Trajectory& trajectory) {
  Steps steps;
  if (!trajectory.points().velocities_mps.empty()) return steps;
  const motion::Trajectory way = thinned(trajectory.points());
  const std::vector<motion::Ns>& times = way.points().times;
  for (std::size_t i = 0; i + 1 < times.size(); ++i) {
    const motion::Motion m = way.at(times[i]).moves;  // that of the way to the next one
    const double mps = length(m.velocity_mps), radps = length(m.angular_velocity_radps);
    ++steps.all;
    if (!(mps <= fastest_vehicle_mps && radps <= fastest_vehicle_radps)) ++steps.too_far;
    steps.fastest_mps = std::max(steps.fastest_mps, mps);
    steps.fastest_radps = std::max(steps.fastest_radps, radps);
  }
  return steps;
}

std::string note_of_snapshots(const VehiclePath& path) {
  const Steps steps = steps_of(*path.trajectory);
  return text::format(
      "the poses are taken as unconnected snapshots: %zu of %zu steps from one to the next are faster than a vehicle goes "
      "(%g m/s, %g rad/s; the fastest: %.3g m/s, %.3g rad/s). The sonar rests within each ping; --motion on moves it",
      steps.too_far, steps.all, fastest_vehicle_mps, fastest_vehicle_radps, steps.fastest_mps, steps.fastest_radps);
}

Result<VehiclePath> path_in(const motion::TrajectoryFile& file, const std::string& name, const std::string& body) {
  auto way = motion::trajectory_of(file, name, body);
  if (!way) return tl::make_unexpected(way.error());
  VehiclePath path;
  path.trajectory = *std::move(way);
  path.begins_at = Time{} + file.begins_at;
  const Steps steps = steps_of(*path.trajectory);
  path.snapshots = steps.too_far * steps_to_one_too_far > steps.all;
  return path;
}

Pose vehicle_at(const VehiclePath& path, Time at) {
  if (path.trajectory) return path.trajectory->at(at - path.begins_at).body_in_world;
  return path.orbits ? circling(path.initial).vehicle_at(0, at) : path.initial;
}

Twist sonar_twist_at(const VehiclePath& path, const Pose& mount, Time at) {
  PoseHistory::Motion moves;
  if (path.snapshots) return {};
  if (path.trajectory) {
    const motion::Motion told = path.trajectory->at(at - path.begins_at).moves;
    if (!motion::is_jump(told.velocity_mps, told.angular_velocity_radps))
      moves = {told.velocity_mps, told.angular_velocity_radps};
  } else if (path.orbits) {
    moves = circling(path.initial).vehicle_moves(0, at);
  }
  return mounted_moves(moves, vehicle_at(path, at), mount);
}

std::vector<Time> times_of(const VehiclePath& path) {
  std::vector<Time> times;
  if (path.trajectory)
    for (const motion::Ns at : path.trajectory->points().times) times.push_back(path.begins_at + at);
  return times;
}

}  // namespace sonar::render
