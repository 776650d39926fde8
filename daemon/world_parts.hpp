// What the World is made of, out of a configuration and a scene: when the daemon starts, and when either changes.
#pragma once

#include "core/scene/scene.hpp"
#include "daemon/config.hpp"
#include "daemon/world.hpp"

namespace sonar {

inline PoseRules pose_rules(const Config& config) {
  PoseRules rules;
  rules.extrapolate_max = nanoseconds_from(config.poses.extrapolate_max_s);
  rules.stale_after = nanoseconds_from(config.poses.stale_after_s);
  rules.max_jump_m = config.poses.max_jump_m;
  rules.stepped = config.clock == ClockMode::stepped;
  return rules;
}
inline std::vector<BodyStart> vehicles_of(const Config& config) {
  std::vector<BodyStart> vehicles;
  for (const VehicleConfig& v : config.vehicles) vehicles.push_back({v.name, v.initial_pose, v.orbits});
  return vehicles;
}
/// In the order of PingRequest::bodies_in_world.
inline std::vector<BodyStart> bodies_of(const Scene& scene) {
  std::vector<BodyStart> bodies;
  for (std::size_t i = 0; i < scene.body_names.size(); ++i)
    bodies.push_back({scene.body_names[i], scene.bodies_in_world.at(i), false});
  return bodies;
}

}  // namespace sonar
