// The world as the physics sees it: triangle meshes with materials, placed by poses in double precision, and point targets.
// Made once by load_scene (or a test) and validated there; the pipeline only reads it.
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

/// How strongly a surface scatters back per unit area, against the incidence angle a (docs/acoustics.md, section 3).
enum class ScatteringLaw {
  lambert,  // mu cos^2 a
  gsab,     // A exp(-a^2 / 2 B^2) + C cos^D a + E exp(-a^2 / 2 F^2), generalised seafloor angular backscatter
};
struct GsabLaw {
  float a_db = -8, b_rad = 0.14f, c_db = -24, d = 2, e_db = -200, f_rad = 0.5f;
  bool operator==(const GsabLaw&) const = default;
};

/// Largest backscatter that conserves energy: Lambert's surface that sends back all it receives has mu = 1 / pi per steradian.
inline constexpr double largest_lambert = 1 / pi;
inline constexpr double largest_lambert_db = -4.97;  // 10 log10 of it, as scene files and messages give it

/// Patches of stronger and weaker scattering, fixed to the surface: a Gamma field with mean 1. Makes K-distributed echoes.
struct Texture {
  float shape = 0;  // nu: scintillation index 1 + 2 / nu; 0 = no texture
  float correlation_m = 0.5f;
  bool operator==(const Texture&) const = default;
};

struct Material {
  std::string name;
  ScatteringLaw law = ScatteringLaw::lambert;
  float lambert_db = -27;         // 10 log10 mu, Mackenzie coefficient; at most largest_lambert_db
  GsabLaw gsab = {};              // when law is gsab
  float trend_db_per_decade = 0;  // change of the scattering strength with frequency, re trend_reference_hz
  float trend_reference_hz = 1e6f;
  float roughness_m = 1e-3f;  // rms; decides how much mirrors and how much scatters
  float reflection = 0.5f;    // pressure reflection coefficient at normal incidence, water-referenced, -1..1
  Texture texture = {};
  Texture grain = {};  // the same for shells and stones: shorter than a beam is wide
  std::uint32_t texture_seed = 0;
  std::string label = {};  // class of its surfaces in labels of samples; empty: its name
  bool operator==(const Material&) const = default;
};

/// Triangles in object coordinates, two-sided, geometric normals. Shared by objects that use the same file.
struct Mesh {
  std::vector<Vec3> vertices;                           // [m]
  std::vector<std::array<std::uint32_t, 3>> triangles;  // indices into vertices, never degenerate
  std::vector<std::uint16_t> material;                  // per triangle, index into Scene::materials
  bool operator==(const Mesh&) const = default;
};

/// The true surface behind a mesh that was made from one: where specular echoes are exact. Same frame as the mesh.
struct Primitive {
  enum class Kind { none, sphere, cylinder, box, plane };
  Kind kind = Kind::none;
  double radius_m = 0;  // sphere, cylinder
  Vec3d size_m = {};    // box: edges; plane: x, y; cylinder: z = length along z
  bool inside = false;  // seen from within, open at the top: a tank
  bool operator==(const Primitive&) const = default;
};

/// A mesh placed in the world. `id` is its place in Scene::objects and keys its speckle.
struct Object {
  std::string name;
  std::shared_ptr<const Mesh> mesh;
  Pose in_world;  // static objects: for ever; moving ones: initially
  int body = -1;  // index into PingRequest::bodies_in_world, -1 = static
  bool visible = true;
  Primitive primitive = {};
  std::string label = {};  // its class in labels of samples; empty: an instance of no class, shown by its material's
  bool operator==(const Object&) const = default;  // true for the same mesh, not for an equal one
};

/// An analytic echo without a surface.
struct PointTarget {
  std::string name;
  Vec3d position_m;  // in the world, or in its body when body >= 0
  float target_strength_db = 0;
  int body = -1;
  std::string label = {};  // as Object::label
  bool operator==(const PointTarget&) const = default;
};

struct SeaSurface {
  bool present = false;
  float lambert_db = -30;
  float roughness_m = 0.01f;       // rms height; still water (0) mirrors
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

/// Another sonar within earshot; its pulses arrive whenever they do.
struct OtherSonar {
  std::string name;
  Vec3d position_m;     // in the world
  float level_upa = 0;  // amplitude in a channel of ours that looks at it, 1 m away; falls as 1 / r and with absorption
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
  std::vector<Pose> bodies_in_world;    // where the scene file put them
  SeaSurface sea_surface;               // its mesh, if present, is one of the objects
  WaterColumn water_column;
  std::vector<OtherSonar> other_sonars;
  std::optional<Vec3d> ray_origin;  // for a scene that was changed while it ran: as before (core/scene/ray_origin.hpp)
  std::vector<std::string> notes;   // what the loader did that its user should know, one sentence each

  /// Where an object sits in its body; in the world for a static one.
  Pose in_body(const Object& object) const {
    if (object.body < 0) return object.in_world;
    return compose(inverse(bodies_in_world.at(static_cast<std::size_t>(object.body))), object.in_world);
  }
  /// Where an object, or a point, is while the bodies are there; bodies that are not given stay where the scene put them.
  Pose in_world(const Object& object, std::span<const Pose> bodies) const {
    return is_attached(object.body, bodies) ? compose(bodies[static_cast<std::size_t>(object.body)], in_body(object))
                                            : object.in_world;
  }
  Vec3d in_world(const PointTarget& point, std::span<const Pose> bodies) const {
    return is_attached(point.body, bodies) ? transform(bodies[static_cast<std::size_t>(point.body)], point.position_m)
                                           : point.position_m;
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
