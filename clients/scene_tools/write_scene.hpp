// An imported world as the text of a scene of ours, with comments that say where things came from and what was left out.
#pragma once

#include <string>
#include <vector>

#include "clients/scene_tools/imported_world.hpp"

namespace sonar::scene_tools {

struct WriteOptions {
  std::vector<std::string> moving;  // models by path; what hangs on them moves with them
  Vec3d offset_m = {};              // added to every place
  std::string command;              // how this was made, for the first comment
};

/// Paths of `moving` that no model has.
std::vector<std::string> unknown_models(const ImportedWorld& world, const std::vector<std::string>& moving);

/// YAML as docs/scenes.md describes it. Every shape needs a material, meshes and heightmaps the path to write. Names are unique,
/// and as short as that allows.
std::string scene_text(const ImportedWorld& world, const std::vector<std::string>& left_out, const WriteOptions& options);

/// Roll, pitch, yaw in degrees (intrinsic Z-Y-X), exact also where the nose points straight up or down.
Vec3d rpy_deg_from(const Quatd& orientation);

}  // namespace sonar::scene_tools
