#include "daemon/render/vehicle_path.hpp"

#include "core/motion/jump.hpp"
#include "daemon/world/world.hpp"

namespace sonar::render {
namespace {

World circling(const Pose& initial) { return World({}, {{"vehicle", initial, true}}, {}, Time{}); }

}  // namespace

Result<VehiclePath> path_in(const motion::TrajectoryFile& file, const std::string& name, const std::string& body) {
  auto way = motion::trajectory_of(file, name, body);
  if (!way) return tl::make_unexpected(way.error());
  VehiclePath path;
  path.trajectory = *std::move(way);
  path.begins_at = Time{} + file.begins_at;
  return path;
}

Pose vehicle_at(const VehiclePath& path, Time at) {
  if (path.trajectory) return path.trajectory->at(at - path.begins_at).body_in_world;
  return path.orbits ? circling(path.initial).vehicle_at(0, at) : path.initial;
}

Twist sonar_twist_at(const VehiclePath& path, const Pose& mount, Time at) {
  PoseHistory::Motion moves;
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
