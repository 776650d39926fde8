// Resolves the name of a scene: a file on disk, else a scene built into the program.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "core/scene/files/load_scene.hpp"

namespace sonar {

struct SceneFile {
  std::filesystem::path path;
  bool built_in = false;  // `path` is one of built_in_scenes; no file is read

  std::string name() const { return (built_in ? "built-in " : "") + path.string(); }
};

/// Searches `directory`, then the shipped scenes on disk, then the built-in ones.
std::optional<SceneFile> find_scene(const std::filesystem::path& given, const std::filesystem::path& directory);
/// Returns the folders that find_scene() searches, for error texts, such as "., A and B".
std::string scene_folders(const std::filesystem::path& directory);

/// True if the name ends in .yaml or .yml; for names from control clients.
bool has_scene_name(const std::filesystem::path& given);
/// True if errors that quote the file may be sent to control clients: only for files in `directory` (the configuration's) and for
/// the shipped scenes, after resolving links.
bool may_be_quoted(const SceneFile& file, const std::filesystem::path& directory);

/// Loads a scene. `world_origin`: the configuration's origin, for grids with latitudes and longitudes. The function is inline, so
/// that code without scenes does not need the scene loader and its libraries.
inline Result<std::shared_ptr<const Scene>> load_scene(const SceneFile& file, const std::optional<Geodetic>& world_origin = {}) {
  return file.built_in ? load_built_in_scene(file.path.string()) : load_scene(file.path, world_origin);
}

// Suggests the closest scene name that find_scene() would find, for errors of configurations and render files.

/// Returns a similar name that find_scene() finds in `directory`; empty if there is none.
std::string nearest_scene(const std::filesystem::path& given, const std::filesystem::path& directory);

}  // namespace sonar
