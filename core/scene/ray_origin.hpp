// The world position to which float coordinates of rays are relative. It is separate from RayScene, so that unchanged objects
// keep exactly the same floats after a change of the scene.
#pragma once

#include <algorithm>
#include <cmath>

#include "core/scene/scene.hpp"

namespace sonar {

/// Scene::ray_origin if it is given, else the middle of all visible static objects, or of the moving ones if there are none.
inline Vec3d ray_origin_of(const Scene& scene) {
  if (scene.ray_origin) return *scene.ray_origin;
  struct Bounds {
    Vec3d low{HUGE_VAL, HUGE_VAL, HUGE_VAL}, high{-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
    void add(Vec3d p) {
      low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
      high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
    }
    bool empty() const { return low.x > high.x; }
    Vec3d centre() const { return 0.5 * (low + high); }
  };
  Bounds fixed, all;
  for (const Object& object : scene.objects) {
    if (!object.visible) continue;
    Bounds local;
    for (const Vec3 v : object.mesh->vertices) local.add(to_double(v));
    if (local.empty()) continue;
    for (int corner = 0; corner < 8; ++corner) {
      const Vec3d p{corner & 1 ? local.high.x : local.low.x, corner & 2 ? local.high.y : local.low.y,
                    corner & 4 ? local.high.z : local.low.z};
      all.add(transform(object.in_world, p));
      if (object.body < 0) fixed.add(transform(object.in_world, p));
    }
  }
  if (!fixed.empty()) return fixed.centre();
  return all.empty() ? Vec3d{} : all.centre();
}

}  // namespace sonar
