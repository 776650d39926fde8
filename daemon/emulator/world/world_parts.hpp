// Makes parts of the World from a configuration and a scene, when the daemon starts and when one of them changes.
#pragma once

#include <algorithm>

#include "core/scene/scene.hpp"
#include "core/text/nearest.hpp"
#include "daemon/config/config.hpp"
#include "daemon/emulator/world/world.hpp"

namespace sonar {

inline PoseRules pose_rules(const Config& config) {
  PoseRules rules;
  rules.extrapolate_max = nanoseconds_from(config.poses.extrapolate_max_s);
  rules.stale_after = nanoseconds_from(config.poses.stale_after_s);
  rules.max_jump_m = config.poses.max_jump_m;
  rules.stepped = config.clock != ClockMode::realtime;
  rules.follows = config.clock == ClockMode::follow;
  return rules;
}
inline std::vector<BodyStart> vehicles_of(const Config& config) {
  std::vector<BodyStart> vehicles;
  for (const VehicleConfig& v : config.vehicles) vehicles.push_back({v.name, v.initial_pose, v.orbits, v.plan});
  return vehicles;
}
/// Returns the moving objects in the order of PingRequest::bodies_in_world. Objects that are only in the configuration are left
/// out.
inline std::vector<BodyStart> bodies_of(const Scene& scene, const Config& config) {
  std::vector<BodyStart> bodies;
  for (std::size_t i = 0; i < scene.body_names.size(); ++i) {
    bodies.push_back({scene.body_names[i], scene.bodies_in_world.at(i), false});
    for (const ObjectConfig& o : config.objects)
      if (o.name == scene.body_names[i]) bodies.back().plan = o.plan;
  }
  return bodies;
}
/// Returns a sentence about an object that should follow a trajectory, if the scene has no moving object of that name; else
/// empty.
inline std::string why_not_movable(const Scene& scene, const Config& config) {
  for (const ObjectConfig& o : config.objects) {
    if (std::find(scene.body_names.begin(), scene.body_names.end(), o.name) != scene.body_names.end()) continue;
    const std::vector<std::string_view> names(scene.body_names.begin(), scene.body_names.end());
    return o.place + ": no moving object of the scene is called \"" + o.name + "\"" +
           text::suggestion(o.name, names, "there are");
  }
  return {};
}

}  // namespace sonar
