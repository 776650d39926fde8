// The content of a Gazebo or URDF file that a scene can hold: shapes placed in the world, and their models.
// read_world fills it, import_scene completes it (finds files, chooses materials), and scene_text writes it.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "clients/scene_tools/xml_file.hpp"
#include "core/base/geometry.hpp"

namespace sonar::scene_tools {

struct Shape {
  enum class Kind { box, sphere, ellipsoid, cylinder, capsule, cone, plane, mesh, heightmap };
  Kind kind = Kind::box;
  Vec3d size_m = {};  // box: edges; ellipsoid: diameters; plane: x, y; heightmap: x, y, height of white above black
  double radius_m = 0, length_m = 0;
  std::string uri = {};     // mesh, heightmap: as the file has it; later the path to write
  Vec3d scale = {1, 1, 1};  // mesh
  std::string part = {};    // mesh: the submesh that is shown; empty: the whole file
  bool is_centred = false;  // the middle of that part lies at the origin
};

struct PlacedShape {
  Shape shape;
  Pose in_world;
  std::size_t model = 0;              // index into ImportedWorld::models
  std::string link = {}, label = {};  // names of the link, and of its visual or collision
  std::string material = {};  // before import_scene: name of the appearance in the file; after it: a material of the scene
  Place at = {};
};

struct ImportedModel {
  std::string path;  // such as ship or ship/crane
  Pose in_world;
  bool is_static = false;
  Place at = {};
  std::string source = {};  // name of the model that an include names
};

struct ImportedWorld {
  std::string name;
  std::string format;  // "Gazebo SDF 1.9", "URDF"
  std::vector<ImportedModel> models;
  std::vector<PlacedShape> shapes;
  std::vector<std::shared_ptr<const XmlFile>> files;  // the files to which the elements and lines above belong
};

/// Access of a reader to referenced files. `find` returns an empty path for a missing file.
struct Library {
  std::function<std::filesystem::path(std::string_view uri, const std::filesystem::path& from_file)> find;
  std::function<Result<std::string>(const std::filesystem::path&)> read;
};

struct ReadOptions {
  bool collisions = false;    // collision shapes instead of visual ones
  bool skip_missing = false;  // omits missing models instead of failing
};

inline constexpr std::size_t max_shapes = 20'000;

/// Reads the world of an SDF, world or URDF text, which its root element identifies. Errors begin with `path`. Depth, models and
/// shapes are bounded for any text and its includes.
Result<ImportedWorld> read_world(std::string_view text, const std::filesystem::path& path, const Library& library,
                                 const ReadOptions& options, Findings& findings);

}  // namespace sonar::scene_tools
