// What is in a scene file, in figures a reader can compare with what was meant: `sonarctl scene info`, and the ground that
// `sonarctl scene check` stands on. The scene is loaded by the loader that the daemon uses.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "core/base/result.hpp"
#include "core/scene/extent.hpp"

namespace sonar::scene_tools {

struct DescribedObject {
  std::string name = {}, kind = {}, file = {};  // kind: as the scene says it (box, mesh, seabed, point, ...)
  std::vector<std::string> materials = {};
  std::size_t triangles = 0;
  Extent own = {}, in_world = {};  // along its own axes, and the world's; where the scene puts it
  std::string moves_with = {};     // the moving object it is or hangs on
  bool visible = true;
};

struct DescribedMaterial {
  std::string name, law;
  double strength_db = 0;  // straight on, at the trend's reference frequency
  double roughness_m = 0, reflection = 0;
  std::size_t objects = 0, triangles = 0;  // 0: defined, or only started from, and not used
};

struct SceneDescription {
  std::string name;
  std::vector<DescribedObject> objects;  // points among them
  std::vector<DescribedMaterial> materials;
  std::vector<std::string> unused_materials;  // of the scene's own
  std::vector<std::string> moving;
  std::size_t points = 0, other_sonars = 0, triangles = 0;
  std::size_t mesh_bytes = 0;  // of distinct meshes
  bool sea_surface = false;
  double volume_db = -200;
  Extent in_world;
  std::vector<std::string> notes;  // the loader's
};

/// Errors and their kinds are the daemon's own. `file` may also be the name of a scene that is built in.
Result<SceneDescription> describe_scene(const std::filesystem::path& file);

/// What its author would want to know about a sound scene, a sentence each.
struct Remarks {
  std::vector<std::string> warnings;  // probably not meant
  std::vector<std::string> notes;
};
Remarks remarks_on(const SceneDescription& scene);

/// "ok: 12 objects (2 moving), 5 materials, 139 000 triangles, 3.2 MB of meshes, x -20..20 y -20..20 z -10..0 m"
std::string summary_of(const SceneDescription& scene);
/// The tables of `info`, and the same as JSON.
std::string table_of(const SceneDescription& scene);
std::string json_of(const SceneDescription& scene);

}  // namespace sonar::scene_tools
