// The world for the physics: triangle meshes with materials, placed by poses in double precision, and point targets.
// load_scene (or a test) makes and validates it; the pipeline only reads it.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/base/geometry.hpp"

namespace sonar {

/// Backscattering per unit area of a surface as a function of the incidence angle a (docs/acoustics.md, section 3).
enum class ScatteringLaw {
  lambert,  // mu cos^2 a
  gsab,     // A exp(-a^2 / 2 B^2) + C cos^D a + E exp(-a^2 / 2 F^2), generalised seafloor angular backscatter
};
struct GsabLaw {
  float a_db = -8, b_rad = 0.14f, c_db = -24, d = 2, e_db = -200, f_rad = 0.5f;
  bool operator==(const GsabLaw&) const = default;
};

/// Largest backscatter that conserves energy: a Lambert surface that scatters all the energy it receives has mu = 1 / pi per
/// steradian.
inline constexpr double largest_lambert = 1 / pi;
inline constexpr double largest_lambert_db = -4.97;  // 10 log10 of largest_lambert, for scene files and messages

/// Patches of stronger and weaker scattering, fixed to the surface: a Gamma field with mean 1. The echoes become K-distributed.
struct Texture {
  float shape = 0;  // nu: scintillation index 1 + 2 / nu; 0 = no texture
  float correlation_m = 0.5f;
  bool operator==(const Texture&) const = default;
};

struct Material {
  std::string name;
  ScatteringLaw law = ScatteringLaw::lambert;
  float lambert_db = -27;         // 10 log10 mu, Mackenzie coefficient; at most largest_lambert_db
  GsabLaw gsab = {};              // used if law is gsab
  float trend_db_per_decade = 0;  // change of the scattering strength with frequency, re trend_reference_hz
  float trend_reference_hz = 1e6f;
  float roughness_m = 1e-3f;  // rms; divides the echo into coherent reflection and scattering
  float reflection = 0.5f;    // pressure reflection coefficient at normal incidence, water-referenced, -1..1
  Texture texture = {};
  Texture grain = {};  // a second texture for shells and stones: patches smaller than a beam
  std::uint32_t texture_seed = 0;
  std::string label = {};  // class of its surfaces in labels of samples; empty: its name
  bool operator==(const Material&) const = default;
};

/// Triangles in object coordinates, with two sides and geometric normals. Objects that use the same file share one mesh.
struct Mesh {
  std::vector<Vec3> vertices;                           // [m]
  std::vector<std::array<std::uint32_t, 3>> triangles;  // indices into vertices, never degenerate
  std::vector<std::uint16_t> material;                  // per triangle, index into Scene::materials
  bool operator==(const Mesh&) const = default;
};

/// The exact surface that a mesh approximates, in the frame of the mesh. Specular echoes are computed from it.
struct Primitive {
  enum class Kind { none, sphere, cylinder, box, plane };
  Kind kind = Kind::none;
  double radius_m = 0;  // sphere, cylinder
  Vec3d size_m = {};    // box: edges; plane: x, y; cylinder: z = length along z
  bool inside = false;  // a tank: seen from inside, open at the top
  bool operator==(const Primitive&) const = default;
};

/// A mesh that is placed in the world or on a moving body. Its index in Scene::objects is part of the key of its random
/// speckle.
struct Object {
  std::string name;
  std::shared_ptr<const Mesh> mesh;
  Pose in_world;  // pose of static objects; initial pose of moving ones
  int body = -1;  // index into PingRequest::bodies_in_world, -1 = static
  bool visible = true;
  Primitive primitive = {};
  std::string label = {};                          // its class in labels of samples; empty: the class of its material
  bool operator==(const Object&) const = default;  // compares addresses of meshes, not their contents
};

/// A point with a target strength and without a surface; its echo is computed analytically.
struct PointTarget {
  std::string name;
  Vec3d position_m;  // in the world, or in its body when body >= 0
  float target_strength_db = 0;
  int body = -1;
  std::string label = {};  // like Object::label
  bool operator==(const PointTarget&) const = default;
};

struct SeaSurface {
  bool present = false;
  float lambert_db = -30;
  float roughness_m = 0.01f;       // rms height; 0 = still water, a mirror
  float bubble_layer_m = 0;        // thickness of the layer of bubbles under it
  float bubble_loss_db_per_m = 0;  // extra absorption in that layer, one way
  bool operator==(const SeaSurface&) const = default;
};

/// Scatterers in the water (docs/acoustics.md, section 3).
struct WaterColumn {
  float volume_db = -200;  // S_v, backscattering strength per cubic metre [dB re 1/m]; below -150 = none
  bool has_volume() const { return volume_db > -150; }
  bool operator==(const WaterColumn&) const = default;
};

/// Another sonar nearby. Its pulses arrive at times that are independent of our pings.
struct OtherSonar {
  std::string name;
  Vec3d position_m;     // in the world
  float level_upa = 0;  // amplitude at 1 m in a channel that points at it; falls as 1 / r and with absorption
  float rate_hz = 7;
  float pulse_s = 1e-4f;
  bool operator==(const OtherSonar&) const = default;
};

struct Scene {
  std::string name;
  std::vector<Material> materials;
  std::vector<Object> objects;
  std::vector<PointTarget> point_targets;
  std::vector<std::string> body_names;  // moving bodies, in the order of PingRequest::bodies_in_world
  std::vector<Pose> bodies_in_world;    // poses of the scene file
  SeaSurface sea_surface;               // its mesh, if present, is one of the objects
  WaterColumn water_column;
  std::vector<OtherSonar> other_sonars;
  std::optional<Vec3d> ray_origin;  // the origin to keep when a running scene is changed (core/scene/extent.hpp)
  std::vector<std::string> notes;   // sentences for the user about decisions of the loader

  /// Returns the pose of an object in its body, or in the world if it is static.
  Pose in_body(const Object& object) const {
    if (object.body < 0) return object.in_world;
    return compose(inverse(bodies_in_world.at(static_cast<std::size_t>(object.body))), object.in_world);
  }
  /// Returns the world pose of an object, or the world position of a point, for these poses of the bodies. Bodies beyond the end
  /// of `bodies` have the poses of the scene file.
  Pose in_world(const Object& object, std::span<const Pose> bodies) const {
    return is_attached(object.body, bodies) ? compose(bodies[static_cast<std::size_t>(object.body)], in_body(object))
                                            : object.in_world;
  }
  Vec3d in_world(const PointTarget& point, std::span<const Pose> bodies) const {
    if (point.body < 0) return point.position_m;
    const auto body = static_cast<std::size_t>(point.body);
    return transform(body < bodies.size() ? bodies[body] : bodies_in_world.at(body), point.position_m);
  }
  std::size_t triangle_count() const {
    std::size_t n = 0;
    for (const Object& o : objects) n += o.mesh->triangles.size();
    return n;
  }

 private:
  static bool is_attached(int body, std::span<const Pose> bodies) {
    return body >= 0 && static_cast<std::size_t>(body) < bodies.size();
  }
};

}  // namespace sonar
