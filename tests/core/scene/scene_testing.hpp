// Scenes made in tests: triangle soups, single facets, and a brute-force ray caster in double precision, with which the fast
// one is compared.
#pragma once

#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <span>

#include "core/base/random.hpp"
#include "core/scene/ray_scene.hpp"
#include "core/scene/scene.hpp"

namespace sonar::tests {

class Draw {  // a stream of uniform numbers, for tests only
 public:
  explicit Draw(std::uint32_t seed) : seed_(seed) {}
  double operator()(double low, double high) {
    const Random4 r = philox(count_++, 0, 0, 0, seed_, 77);
    return low + (high - low) * static_cast<double>(uniform_open(r.v[0]));
  }
  Vec3d point(double half) { return {(*this)(-half, half), (*this)(-half, half), (*this)(-half, half)}; }
  Quatd turn() { return normalized(Quatd{(*this)(-1, 1), (*this)(-1, 1), (*this)(-1, 1), (*this)(-1, 1)}); }

 private:
  std::uint32_t seed_, count_ = 0;
};

inline std::shared_ptr<const Mesh> soup(Draw& draw, int triangles, double half_m, double size_m) {
  auto mesh = std::make_shared<Mesh>();
  for (int i = 0; i < triangles; ++i) {
    const Vec3d c = draw.point(half_m);
    const auto first = static_cast<std::uint32_t>(mesh->vertices.size());
    for (int k = 0; k < 3; ++k) mesh->vertices.push_back(to_float(c + draw.point(size_m)));
    mesh->triangles.push_back({first, first + 1, first + 2});
    mesh->material.push_back(0);
  }
  return mesh;
}

struct Hit {
  double distance_m = std::numeric_limits<double>::infinity();
  std::uint32_t object = RayPacket::miss, triangle = 0;
  Vec3d normal;
};

inline Pose place_of(const Scene& scene, const Object& object, std::span<const Pose> bodies) {
  if (object.body < 0) return object.in_world;
  const auto b = static_cast<std::size_t>(object.body);
  return compose(bodies[b], compose(inverse(scene.bodies_in_world[b]), object.in_world));
}

inline std::optional<double> cross_triangle(Vec3d from, Vec3d along, Vec3d a, Vec3d b, Vec3d c) {
  const Vec3d e1 = b - a, e2 = c - a, p = cross(along, e2);
  const double det = dot(e1, p);
  if (det == 0) return std::nullopt;
  const Vec3d s = from - a, q = cross(s, e1);
  const double u = dot(s, p) / det, v = dot(along, q) / det, t = dot(e2, q) / det;
  if (u < 0 || v < 0 || u + v > 1 || t < 0) return std::nullopt;
  return t;
}

inline Hit brute_force(const Scene& scene, std::span<const Pose> bodies, Vec3d from_in_world, Vec3d along, double far_m) {
  Hit best;
  for (std::size_t o = 0; o < scene.objects.size(); ++o) {
    const Object& object = scene.objects[o];
    if (!object.visible) continue;
    const Pose pose = place_of(scene, object, bodies);
    for (std::size_t t = 0; t < object.mesh->triangles.size(); ++t) {
      Vec3d p[3];
      for (std::size_t k = 0; k < 3; ++k) p[k] = transform(pose, to_double(object.mesh->vertices[object.mesh->triangles[t][k]]));
      const auto d = cross_triangle(from_in_world, along, p[0], p[1], p[2]);
      if (!d || *d > far_m || *d >= best.distance_m) continue;
      best = Hit{*d, static_cast<std::uint32_t>(o), static_cast<std::uint32_t>(t), cross(p[1] - p[0], p[2] - p[0])};
    }
  }
  return best;
}

inline void set_ray(RayPacket& rays, int lane, Vec3d from_in_origin, Vec3d along, double far_m) {
  const Vec3 o = to_float(from_in_origin), d = to_float(along);
  rays.origin_x[lane] = o.x, rays.origin_y[lane] = o.y, rays.origin_z[lane] = o.z;
  rays.direction_x[lane] = d.x, rays.direction_y[lane] = d.y, rays.direction_z[lane] = d.z;
  rays.far[lane] = static_cast<float>(far_m);
}

}  // namespace sonar::tests
