// `sonarctl scene import`: converts a Gazebo world or model, or a URDF, to a scene file. It finds meshes
// and heightmaps, tests them, chooses materials, and writes and checks the scene file.
#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "clients/scene_tools/imported_world.hpp"
#include "core/base/geometry.hpp"
#include "core/base/result.hpp"
#include "core/scene/extent.hpp"

namespace sonar::scene_tools {

// Finds the mesh and heightmap files that an imported world names, and tests whether the scene's loader can read them. A scene
// file has whole meshes with one positive scale, so parts of files and meshes with other scales are converted to new files.
// import_scene uses this class.

class FileResolver {
 public:
  FileResolver(const Library& library, std::filesystem::path scene, bool skip_missing, bool try_files, Findings& findings);
  /// Sets path, scale and size of a shape that comes from a file. Returns false if the file is missing, or if it cannot be used
  /// and is listed as omitted.
  bool resolve(PlacedShape& placed);
  /// Reports an error if files are missing and must not be skipped; it names each file once.
  void report_missing();
  /// Writes the meshes that had to be converted into a folder beside the scene.
  Result<void> write_converted();
  std::size_t converted() const { return converted_.size(); }

 private:
  bool resolve_mesh(PlacedShape& placed, const std::filesystem::path& file);
  bool resolve_heightmap(PlacedShape& placed, const std::filesystem::path& file);
  std::string why_not(const std::filesystem::path& file);
  bool convert(PlacedShape& placed, const std::filesystem::path& file);
  std::string path_to_write(const std::filesystem::path& file) const;

  const Library& library_;
  std::filesystem::path scene_;
  bool skip_missing_, try_files_;
  Findings& findings_;
  struct Missing {
    Place at;
    std::string what, fetch;  // fetch: a command; may be empty
  };
  std::vector<Missing> missing_;
  std::map<std::filesystem::path, std::string> tried_;      // why a mesh cannot be used; empty if it can
  std::map<std::string, std::string> known_conversions_;    // by file, part and scale: the path of the new mesh
  std::map<std::filesystem::path, std::string> converted_;  // file to write, its text
};

struct ImportOptions {
  std::filesystem::path file, out;
  std::vector<std::filesystem::path> model_folders;
  ReadOptions read;
  std::vector<std::string> materials;  // NAME for everything, MODEL=NAME for one model and what is in it
  std::vector<std::string> moving;     // paths of the models that move
  Vec3d offset_m = {};
  bool check = true;  // load every mesh, and finally the scene, as the daemon does
  bool overwrite = false;
};

struct Imported {
  std::size_t models = 0, shapes = 0, converted_meshes = 0;
  std::vector<std::string> left_out;
};

/// Errors begin with file:line. Writes nothing if a part cannot be converted. A scene that is written but cannot be loaded stays
/// on disk, so that the user can inspect it.
Result<Imported> import_scene(const ImportOptions& options);

// The declarations below describe the content of a scene file in numbers that its author can check. `sonarctl scene info` prints
// the numbers, and `sonarctl scene check` uses them. The loader is that of the daemon.

// Numbers, lengths and sizes of a scene as text. Only the scene tools use these functions.

/// Returns "139 000" for 139000.
std::string grouped(std::size_t number);
/// Returns three significant digits, such as "12.3 m" or "4.5 mm".
std::string length_text(double length_m);
/// Returns "12.3 x 4 x 0.5".
std::string size_text(Vec3d size_m);
/// Returns "(1, -2.5, 0)".
std::string place_text(Vec3d place_m);
/// Returns "3.2 MB".
std::string bytes_text(std::size_t bytes);

struct DescribedObject {
  std::string name = {}, kind = {}, file = {};  // kind: as in the scene (box, mesh, seabed, point, ...)
  std::vector<std::string> materials = {};
  std::size_t triangles = 0;
  Extent own = {}, in_world = {};  // along its own axes, and along the world's axes at its pose in the scene
  std::string moves_with = {};     // name of the moving object: itself, or the one that it is attached to
  bool visible = true;
};

struct DescribedMaterial {
  std::string name, law;
  double strength_db = 0;  // at normal incidence and at trend_reference_hz
  double roughness_m = 0, reflection = 0;
  std::size_t objects = 0, triangles = 0;  // 0: not used, or only as a base of other materials
};

struct SceneDescription {
  std::string name;
  std::vector<DescribedObject> objects;  // including points
  std::vector<DescribedMaterial> materials;
  std::vector<std::string> unused_materials;  // unused ones among the scene's own materials
  std::vector<std::string> moving;
  std::size_t points = 0, other_sonars = 0, triangles = 0;
  std::size_t mesh_bytes = 0;  // each mesh counts once
  bool sea_surface = false;
  double volume_db = -200;
  Extent in_world;
  std::vector<std::string> notes;  // notes of the loader
};

/// Loads a scene and describes it. Errors are those of the daemon. `file` may also name a built-in scene.
Result<SceneDescription> describe_scene(const std::filesystem::path& file);

/// Remarks on a valid scene for its author.
struct Remarks {
  std::vector<std::string> warnings;  // parts of the scene that are probably unintended
  std::vector<std::string> notes;
};
Remarks remarks_on(const SceneDescription& scene);

/// Returns "12 objects (2 moving), 5 materials, 139 000 triangles, 3.2 MB of meshes, x -20..20, y -20..20, z -10..0 m".
std::string summary_of(const SceneDescription& scene);
/// Return what `info` prints, as tables and as JSON.
std::string table_of(const SceneDescription& scene);
std::string json_of(const SceneDescription& scene);

}  // namespace sonar::scene_tools
