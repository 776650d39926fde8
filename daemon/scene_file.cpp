#include "daemon/scene_file.hpp"

#include <algorithm>
#include <system_error>
#include <vector>

#include "core/scene/files/built_in_scenes.hpp"

namespace sonar {
namespace {

/// Where the program was put first, so that an unpacked or moved installation finds its own; in a build folder links lead to the
/// tree (CMakeLists.txt), whose place the program does not know.
std::vector<std::filesystem::path> make_shipped_folders() {
  std::error_code ec;
  std::vector<std::filesystem::path> folders;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", ec);
  if (!ec) folders.push_back((program.parent_path() / SONARD_SCENES_FROM_PROGRAM).lexically_normal());
  folders.emplace_back(SONARD_SCENES_INSTALLED);
  std::erase_if(folders, [&](const std::filesystem::path& folder) { return !std::filesystem::is_directory(folder, ec); });
  for (std::filesystem::path& folder : folders)
    if (auto real = std::filesystem::canonical(folder, ec); !ec) folder = std::move(real);
  return folders;
}
const std::vector<std::filesystem::path>& shipped_folders() {
  static const std::vector<std::filesystem::path> folders = make_shipped_folders();
  return folders;
}

/// Links followed. The root holds everything: it is nobody's folder of scenes.
bool is_below(const std::filesystem::path& file, const std::filesystem::path& folder) {
  std::error_code ec;
  const auto real = std::filesystem::canonical(file, ec);
  if (ec) return false;
  const auto top = std::filesystem::canonical(folder.empty() ? std::filesystem::path(".") : folder, ec);
  if (ec || top == top.root_path()) return false;
  return std::mismatch(top.begin(), top.end(), real.begin(), real.end()).first == top.end();
}

}  // namespace

bool has_scene_name(const std::filesystem::path& given) { return given.extension() == ".yaml" || given.extension() == ".yml"; }

bool may_be_quoted(const SceneFile& file, const std::filesystem::path& directory) {
  if (file.built_in || is_below(file.path, directory)) return true;
  const auto& shipped = shipped_folders();
  return std::any_of(shipped.begin(), shipped.end(), [&](const auto& folder) { return is_below(file.path, folder); });
}

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
