// Implements RayScene with the exact planes, boxes, spheres and cylinders of a scene instead of Embree. A program that is
// linked with this file contains no third-party ray tracer, so that the thread sanitizer sees all code. Objects of other shapes
// are invisible to rays. The code is intentionally simple and slow.
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "core/scene/ray_scene.hpp"

namespace sonar {
namespace {

constexpr double face_tolerance_m = 1e-5;

struct Hit {
  double distance_m = HUGE_VAL;
  Vec3d normal;       // object axes
  int axis = 0;       // normal of a flat face
  double at_m = NAN;  // position of that face on its axis; NaN for curved surfaces
};

double along(Vec3d v, int axis) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; }
Vec3d unit(int axis) { return {axis == 0 ? 1.0 : 0, axis == 1 ? 1.0 : 0, axis == 2 ? 1.0 : 0}; }

struct Ray {
  Vec3d from, direction;
  Vec3d at(double t) const { return from + t * direction; }
};

/// Tries the plane across an axis; it counts as a hit where `covers` is true.
template <class Covers>
void try_face(const Ray& ray, int axis, double at_m, Hit& best, Covers&& covers) {
  const double speed = along(ray.direction, axis);
  if (speed == 0) return;
  const double t = (at_m - along(ray.from, axis)) / speed;
  if (t > 0 && t < best.distance_m && covers(ray.at(t))) best = {t, unit(axis), axis, at_m};
}

/// Tries a sphere, or, if the z of both vectors is 0, the side of a cylinder.
template <class Covers>
void try_round(const Ray& ray, Vec3d from, Vec3d direction, double radius_m, Hit& best, Covers&& covers) {
  const double a = dot(direction, direction), b = dot(from, direction), c = dot(from, from) - radius_m * radius_m;
  const double root = b * b - a * c;
  if (a == 0 || root < 0) return;
  for (const double t : {(-b - std::sqrt(root)) / a, (-b + std::sqrt(root)) / a})
    if (t > 0 && t < best.distance_m && covers(ray.at(t))) best = {t, from + t * direction, 0, NAN};
}

Hit hit(const Primitive& shape, const Ray& ray) {
  Hit best;
  const auto within = [](double v, double size) { return std::abs(v) <= size / 2; };
  const Vec3d size = shape.size_m;
  switch (shape.kind) {
    case Primitive::Kind::none:
      break;
    case Primitive::Kind::plane:
      try_face(ray, 2, 0, best, [&](Vec3d p) { return within(p.x, size.x) && within(p.y, size.y); });
      break;
    case Primitive::Kind::sphere:
      try_round(ray, ray.from, ray.direction, shape.radius_m, best, [](Vec3d) { return true; });
      break;
    case Primitive::Kind::box:
      for (int axis = 0; axis < 3; ++axis) {
        const int u = (axis + 1) % 3, v = (axis + 2) % 3;
        const auto covers = [&](Vec3d p) { return within(along(p, u), along(size, u)) && within(along(p, v), along(size, v)); };
        try_face(ray, axis, -along(size, axis) / 2, best, covers);
        if (axis < 2 || !shape.inside) try_face(ray, axis, along(size, axis) / 2, best, covers);
      }
      break;
    case Primitive::Kind::cylinder: {
      const auto disc = [&](Vec3d p) { return std::hypot(p.x, p.y) <= shape.radius_m; };
      try_round(ray, {ray.from.x, ray.from.y, 0}, {ray.direction.x, ray.direction.y, 0}, shape.radius_m, best,
                [&](Vec3d p) { return within(p.z, size.z); });
      try_face(ray, 2, -size.z / 2, best, disc);
      if (!shape.inside) try_face(ray, 2, size.z / 2, best, disc);
      break;
    }
  }
  return best;
}

/// For each flat face, the first triangle of the mesh in that face. Callers use a triangle only for its material or its face.
struct Faces {
  struct Face {
    int axis = 0;
    double at_m = 0;
    std::uint32_t triangle = 0;
  };
  std::vector<Face> known;

  Faces(const Mesh& mesh, const Primitive& shape) {
    const Vec3d half = 0.5 * shape.size_m;
    for (int axis = 0; axis < 3; ++axis)
      for (const double at_m : {-along(half, axis), along(half, axis)})
        for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t)
          if (lies_in(mesh, mesh.triangles[t], axis, at_m)) {
            known.push_back({axis, at_m, t});
            break;
          }
  }
  static bool lies_in(const Mesh& mesh, const std::array<std::uint32_t, 3>& corners, int axis, double at_m) {
    return std::all_of(corners.begin(), corners.end(), [&](std::uint32_t i) {
      return std::abs(along(to_double(mesh.vertices[i]), axis) - at_m) < face_tolerance_m;
    });
  }
  std::uint32_t triangle(const Hit& at) const {
    for (const Face& face : known)
      if (face.axis == at.axis && std::abs(face.at_m - at.at_m) < face_tolerance_m) return face.triangle;
    return 0;
  }
};

}  // namespace

struct RayScene::Impl {
  struct Thing {
    std::uint32_t object = 0;
    Primitive shape;
    Faces faces;
    Pose in_world;
    Rotation turned;
  };
  std::shared_ptr<const Scene> scene;
  std::vector<Thing> things;

  explicit Impl(std::shared_ptr<const Scene> of) : scene(std::move(of)) {
    for (std::size_t i = 0; i < scene->objects.size(); ++i) {
      const Object& object = scene->objects[i];
      if (!object.visible || object.primitive.kind == Primitive::Kind::none) continue;
      things.push_back({static_cast<std::uint32_t>(i), object.primitive, Faces(*object.mesh, object.primitive), {}, {}});
    }
    place({});
  }
  void place(std::span<const Pose> bodies) {
    for (Thing& thing : things) {
      thing.in_world = scene->in_world(scene->objects[thing.object], bodies);
      thing.turned = rotation_from(thing.in_world.orientation);
    }
  }
};

RayScene::RayScene(std::shared_ptr<const Scene> scene, int) : impl_(std::make_unique<Impl>(std::move(scene))) {}
RayScene::~RayScene() = default;
void RayScene::change(std::shared_ptr<const Scene> scene) { impl_ = std::make_unique<Impl>(std::move(scene)); }
const Scene& RayScene::scene() const { return *impl_->scene; }
Vec3d RayScene::origin() const { return {}; }
void RayScene::place(std::span<const Pose> bodies_in_world) { impl_->place(bodies_in_world); }
int RayScene::rays_at_once() const { return 1; }
std::string RayScene::version() { return "analytic rays"; }

void RayScene::trace(RayPacket& rays, std::uint32_t active, bool) const {
  for (int i = 0; i < RayPacket::size; ++i) {
    rays.object[i] = RayPacket::miss;
    if (((active >> i) & 1) == 0) continue;
    rays.normal_x[i] = rays.normal_y[i] = rays.normal_z[i] = 0;
    const Vec3d from{rays.origin_x[i], rays.origin_y[i], rays.origin_z[i]};
    const Vec3d direction{rays.direction_x[i], rays.direction_y[i], rays.direction_z[i]};
    for (const Impl::Thing& thing : impl_->things) {
      const Rotation back = transposed(thing.turned);
      const Hit at = hit(thing.shape, {back * (from - thing.in_world.position_m), back * direction});
      if (!(at.distance_m < static_cast<double>(rays.far[i]))) continue;
      const Vec3 normal = to_float(thing.turned * at.normal);
      rays.far[i] = static_cast<float>(at.distance_m);
      rays.object[i] = thing.object;
      rays.triangle[i] = thing.faces.triangle(at);
      rays.normal_x[i] = normal.x, rays.normal_y[i] = normal.y, rays.normal_z[i] = normal.z;
    }
  }
}

}  // namespace sonar
