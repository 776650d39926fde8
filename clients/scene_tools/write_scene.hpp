// Writes an imported world as the text of a scene, with comments on the origin of each part and on omitted parts.
#pragma once

#include <string>
#include <vector>

#include "clients/scene_tools/imported_world.hpp"

namespace sonar::scene_tools {

struct WriteOptions {
  std::vector<std::string> moving;  // paths of models; models attached to them move with them
  Vec3d offset_m = {};              // added to every position
  std::string command;              // name of the source file, for the first comment
};

/// Returns the paths in `moving` that no model has.
std::vector<std::string> unknown_models(const ImportedWorld& world, const std::vector<std::string>& moving);

/// Returns YAML in the format of docs/scenes.md. Every shape needs a material; meshes and heightmaps need the path to write.
/// Names become unique and as short as possible.
std::string scene_text(const ImportedWorld& world, const std::vector<std::string>& left_out, const WriteOptions& options);

/// Returns roll, pitch and yaw in degrees (intrinsic Z-Y-X), exact also if the nose points straight up or down.
Vec3d rpy_deg_from(const Quatd& orientation);

}  // namespace sonar::scene_tools
