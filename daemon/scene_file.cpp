#include "daemon/scene_file.hpp"

#include <system_error>
#include <vector>

#include "core/scene/files/built_in_scenes.hpp"

namespace sonar {
namespace {

/// Where the program was put first, so that an unpacked or moved installation finds its own; then the tree it was built from.
std::vector<std::filesystem::path> make_shipped_folders() {
  std::error_code ec;
  std::vector<std::filesystem::path> folders;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", ec);
  if (!ec) folders.push_back((program.parent_path() / SONARD_SCENES_FROM_PROGRAM).lexically_normal());
  for (const char* folder : {SONARD_SCENES_SOURCE, SONARD_SCENES_INSTALLED}) folders.emplace_back(folder);
  std::erase_if(folders, [&](const std::filesystem::path& folder) { return !std::filesystem::is_directory(folder, ec); });
  return folders;
}
const std::vector<std::filesystem::path>& shipped_folders() {
  static const std::vector<std::filesystem::path> folders = make_shipped_folders();
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
  std::string text = directory.empty() ? "." : directory.string();
  for (const auto& folder : shipped_folders()) text += (&folder == &shipped_folders().back() ? " and " : ", ") + folder.string();
  return text;
}

}  // namespace sonar
