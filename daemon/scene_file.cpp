#include "daemon/scene_file.hpp"

#include <array>
#include <system_error>

#include "core/scene/files/built_in_scenes.hpp"

namespace sonar {
namespace {

const std::array<std::filesystem::path, 2>& shipped_folders() {
  static const std::array<std::filesystem::path, 2> folders{SONARD_SCENES_SOURCE, SONARD_SCENES_INSTALLED};
  return folders;
}

}  // namespace

std::optional<SceneFile> find_scene(const std::filesystem::path& given, const std::filesystem::path& directory) {
  std::error_code ec;
  const auto is_file = [&](const std::filesystem::path& place) { return std::filesystem::is_regular_file(place, ec); };
  if (is_file(directory / given)) return SceneFile{(directory / given).lexically_normal()};
  for (const auto& scenes : shipped_folders())
    for (const auto& place : {scenes / given, scenes.parent_path() / given})  // "demo.yaml", "scenes/demo.yaml"
      if (is_file(place)) return SceneFile{place.lexically_normal()};
  if (is_built_in_scene(given.string())) return SceneFile{given, true};
  return std::nullopt;
}

std::string scene_folders(const std::filesystem::path& directory) {
  return (directory.empty() ? std::string(".") : directory.string()) + ", " + shipped_folders()[0].string() + " and " +
         shipped_folders()[1].string();
}

}  // namespace sonar
