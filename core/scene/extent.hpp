// The box around points or meshes, and limits for sizes that are probably mistakes. `sonarctl scene` and
// daemon/emulator/world/plausibility check scenes and poses with them.
#pragma once

#include <algorithm>
#include <string_view>

#include "core/base/geometry.hpp"
#include "core/scene/scene.hpp"

namespace sonar {

/// A box in the axes of its points [m]; empty if low > high.
struct Extent {
  Vec3d low_m{1e300, 1e300, 1e300}, high_m{-1e300, -1e300, -1e300};
  void add(Vec3d p) {
    low_m = {std::min(low_m.x, p.x), std::min(low_m.y, p.y), std::min(low_m.z, p.z)};
    high_m = {std::max(high_m.x, p.x), std::max(high_m.y, p.y), std::max(high_m.z, p.z)};
  }
  void add(const Extent& other) {
    if (other.empty()) return;
    add(other.low_m);
    add(other.high_m);
  }
  bool empty() const { return low_m.x > high_m.x; }
  Vec3d size_m() const { return empty() ? Vec3d{} : high_m - low_m; }
  Vec3d centre_m() const { return empty() ? Vec3d{} : 0.5 * (low_m + high_m); }
  double longest_m() const {
    const Vec3d size = size_m();
    return std::max({size.x, size.y, size.z});
  }
  /// Distance from the nearest point of the box; 0 inside.
  double distance_m(Vec3d p) const {
    const auto outside = [](double low, double at, double high) { return std::max({low - at, 0.0, at - high}); };
    return length(Vec3d{outside(low_m.x, p.x, high_m.x), outside(low_m.y, p.y, high_m.y), outside(low_m.z, p.z, high_m.z)});
  }
  bool operator==(const Extent&) const = default;
};

/// The box in the axes of the mesh.
inline Extent extent_of(const Mesh& mesh) {
  Extent extent;
  for (const Vec3& v : mesh.vertices) extent.add(to_double(v));
  return extent;
}

/// A mesh longer than this [m] was probably not written in metres.
inline constexpr double huge_mesh_m = 200;
inline constexpr std::string_view huge_mesh_cure = "if the file is in centimetres or millimetres, set scale: 0.01 or 0.001";

// The world position to which float coordinates of rays are relative. It is separate from RayScene, so that unchanged objects
// keep exactly the same floats after a change of the scene.

/// Scene::ray_origin if it is given, else the middle of all visible static objects, or of the moving ones if there are none.
inline Vec3d ray_origin_of(const Scene& scene) {
  if (scene.ray_origin) return *scene.ray_origin;
  Extent fixed, all;
  for (const Object& object : scene.objects) {
    if (!object.visible) continue;
    const Extent local = extent_of(*object.mesh);
    if (local.empty()) continue;
    for (int corner = 0; corner < 8; ++corner) {
      const Vec3d p{corner & 1 ? local.high_m.x : local.low_m.x, corner & 2 ? local.high_m.y : local.low_m.y,
                    corner & 4 ? local.high_m.z : local.low_m.z};
      all.add(transform(object.in_world, p));
      if (object.body < 0) fixed.add(transform(object.in_world, p));
    }
  }
  if (!fixed.empty()) return fixed.centre_m();
  return all.empty() ? Vec3d{} : all.centre_m();
}

}  // namespace sonar
