// The world as the physics sees it: triangle meshes with materials, placed by poses in double precision, and point targets.
// Made once by load_scene (or a test) and validated there; the pipeline only reads it.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/base/geometry.hpp"

namespace sonar {

struct Material {
  std::string name;
  float lambert_db = -27;     // 10 log10 mu, Mackenzie coefficient; at most -4.97 (energy conservation)
  float roughness_m = 1e-3f;  // rms
  float reflection = 0.5f;    // pressure reflection coefficient at normal incidence, water-referenced, -1..1
  std::uint32_t texture_seed = 0;
};

/// Triangles in object coordinates, two-sided, geometric normals. Shared by objects that use the same file.
struct Mesh {
  std::vector<Vec3> vertices;                           // [m]
  std::vector<std::array<std::uint32_t, 3>> triangles;  // indices into vertices, never degenerate
  std::vector<std::uint16_t> material;                  // per triangle, index into Scene::materials
};

/// A mesh placed in the world. `id` is its place in Scene::objects and keys its speckle.
struct Object {
  std::string name;
  std::shared_ptr<const Mesh> mesh;
  Pose in_world;  // static objects: for ever; moving ones: initially
  int body = -1;  // index into PingRequest::bodies_in_world, -1 = static
  bool visible = true;
};

/// An analytic echo without a surface.
struct PointTarget {
  std::string name;
  Vec3d position_m;  // in the world, or in its body when body >= 0
  float target_strength_db = 0;
  int body = -1;
};

struct SeaSurface {
  bool present = false;
  float lambert_db = -30;
};

struct Scene {
  std::string name;
  std::vector<Material> materials;
  std::vector<Object> objects;
  std::vector<PointTarget> point_targets;
  std::vector<std::string> body_names;  // moving bodies, in the order of PingRequest::bodies_in_world
  std::vector<Pose> bodies_in_world;    // where the scene file put them
  SeaSurface sea_surface;               // its mesh, if present, is one of the objects
  std::vector<std::string> notes;       // what the loader did that its user should know, one sentence each

  /// Where an object sits in its body; in the world for a static one.
  Pose in_body(const Object& object) const {
    if (object.body < 0) return object.in_world;
    return compose(inverse(bodies_in_world.at(static_cast<std::size_t>(object.body))), object.in_world);
  }
  std::size_t triangle_count() const {
    std::size_t n = 0;
    for (const Object& o : objects) n += o.mesh->triangles.size();
    return n;
  }
};

}  // namespace sonar
