// Describes the content of a scene file in numbers that its author can check: `sonarctl scene info` and the basis of
// `sonarctl scene check`. Uses the scene loader of the daemon.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "core/base/result.hpp"
#include "core/scene/extent.hpp"

namespace sonar::scene_tools {

struct DescribedObject {
  std::string name = {}, kind = {}, file = {};  // kind: as in the scene (box, mesh, seabed, point, ...)
  std::vector<std::string> materials = {};
  std::size_t triangles = 0;
  Extent own = {}, in_world = {};  // along its own axes, and along the world's axes at its place in the scene
  std::string moves_with = {};     // the moving object that it is or is attached to
  bool visible = true;
};

struct DescribedMaterial {
  std::string name, law;
  double strength_db = 0;  // at normal incidence and the trend's reference frequency
  double roughness_m = 0, reflection = 0;
  std::size_t objects = 0, triangles = 0;  // 0: not used, or only as a base of other materials
};

struct SceneDescription {
  std::string name;
  std::vector<DescribedObject> objects;  // points among them
  std::vector<DescribedMaterial> materials;
  std::vector<std::string> unused_materials;  // unused ones among the scene's own materials
  std::vector<std::string> moving;
  std::size_t points = 0, other_sonars = 0, triangles = 0;
  std::size_t mesh_bytes = 0;  // each mesh counts once
  bool sea_surface = false;
  double volume_db = -200;
  Extent in_world;
  std::vector<std::string> notes;  // the loader's
};

/// Returns the errors of the daemon. `file` may also name a built-in scene.
Result<SceneDescription> describe_scene(const std::filesystem::path& file);

/// Remarks on a valid scene for its author.
struct Remarks {
  std::vector<std::string> warnings;  // probably unintended
  std::vector<std::string> notes;
};
Remarks remarks_on(const SceneDescription& scene);

/// "ok: 12 objects (2 moving), 5 materials, 139 000 triangles, 3.2 MB of meshes, x -20..20 y -20..20 z -10..0 m"
std::string summary_of(const SceneDescription& scene);
/// The tables of `info`, and the same as JSON.
std::string table_of(const SceneDescription& scene);
std::string json_of(const SceneDescription& scene);

}  // namespace sonar::scene_tools
