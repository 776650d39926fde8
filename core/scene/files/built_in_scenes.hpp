// The shipped scenes that CMake builds into the program from scenes/, so that the demo and the benchmark need no files on disk.
#pragma once

#include <algorithm>
#include <array>
#include <span>
#include <string_view>

namespace sonar {

/// Names that load_built_in_scene() accepts.
inline constexpr std::array<std::string_view, 2> built_in_scenes{"demo.yaml", "local-search.yaml"};
constexpr bool is_built_in_scene(std::string_view name) {
  return std::find(built_in_scenes.begin(), built_in_scenes.end(), name) != built_in_scenes.end();
}

/// A scene, or a mesh that one of the scenes uses; `name` is relative to scenes/.
struct BuiltInFile {
  std::string_view name, contents;
};
std::span<const BuiltInFile> built_in_files();

}  // namespace sonar
