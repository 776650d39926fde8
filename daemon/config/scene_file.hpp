// Which scene a name stands for: a file on disk if there is one, else a scene that is part of the program.
// Used by the configuration, `sonard run`, `sonard check` and `sonard bench`, so that all of them find the same.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "core/scene/files/load_scene.hpp"

namespace sonar {

struct SceneFile {
  std::filesystem::path path;
  bool built_in = false;  // then `path` is one of built_in_scenes, and nothing is read from disk

  std::string name() const { return (built_in ? "built-in " : "") + path.string(); }
};

/// In `directory`, then among the shipped scenes on disk, then among the built-in ones.
std::optional<SceneFile> find_scene(const std::filesystem::path& given, const std::filesystem::path& directory);
/// The folders that find_scene() looks in, for its caller's error: "., A and B".
std::string scene_folders(const std::filesystem::path& directory);

/// For those who ask from outside: true of names that end in .yaml or .yml.
bool has_scene_name(const std::filesystem::path& given);
/// Whether errors with words of the file may go to those who ask from outside: it is in `directory`, the configuration's, or
/// among the shipped scenes. Links count as what they lead to.
bool may_be_quoted(const SceneFile& file, const std::filesystem::path& directory);

/// Inline, so that the configuration alone does not need the scene loader and its libraries.
inline Result<std::shared_ptr<const Scene>> load_scene(const SceneFile& file) {
  return file.built_in ? load_built_in_scene(file.path.string()) : load_scene(file.path);
}

}  // namespace sonar
