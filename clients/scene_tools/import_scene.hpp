// `sonarctl scene import`: converts a Gazebo world or model, or a URDF, to a scene file: finds and tries meshes
// and heightmaps, chooses materials, writes and checks the result.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "clients/scene_tools/imported_world.hpp"
#include "core/base/result.hpp"

namespace sonar::scene_tools {

struct ImportOptions {
  std::filesystem::path file, out;
  std::vector<std::filesystem::path> model_folders;
  ReadOptions read;
  std::vector<std::string> materials;  // NAME for everything, MODEL=NAME for one model and what is in it
  std::vector<std::string> moving;     // models by path
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

}  // namespace sonar::scene_tools
