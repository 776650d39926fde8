// Queries that are the same for every ray tracer.
#include "core/scene/ray_scene.hpp"

namespace sonar {

bool is_occluded(const RayScene& scene, Vec3d from, Vec3d place) {
  RayPacket ray{};
  const double distance = length(place - from);
  const Vec3 o = to_float(from - scene.origin()), d = to_float((1 / distance) * (place - from));
  ray.origin_x[0] = o.x, ray.origin_y[0] = o.y, ray.origin_z[0] = o.z;
  ray.direction_x[0] = d.x, ray.direction_y[0] = d.y, ray.direction_z[0] = d.z;
  ray.far[0] = static_cast<float>(distance) * 0.9999f;
  scene.trace(ray, 1u, false);
  return ray.object[0] != RayPacket::miss;
}

}  // namespace sonar
