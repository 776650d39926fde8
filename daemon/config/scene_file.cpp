#include "daemon/config/scene_file.hpp"

#include <algorithm>
#include <fstream>
#include <sstream>
#include <system_error>
#include <vector>

#include "core/scene/files/built_in_scenes.hpp"
#include "core/text/nearest.hpp"

namespace sonar {
namespace {

/// Returns the folders of shipped scenes. Folders near the program come first, so that an unpacked or moved installation finds
/// its own files. A build folder has links to the source tree (CMakeLists.txt), because the program does not contain the tree's
/// path.
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

/// True if a file is below a folder, after resolving links. False for the root directory, which contains all files.
bool is_below(const std::filesystem::path& file, const std::filesystem::path& folder) {
  std::error_code ec;
  const auto real = std::filesystem::canonical(file, ec);
  if (ec) return false;
  const auto top = std::filesystem::canonical(folder.empty() ? std::filesystem::path(".") : folder, ec);
  if (ec || top == top.root_path()) return false;
  return std::mismatch(top.begin(), top.end(), real.begin(), real.end()).first == top.end();
}

constexpr int most_looked_at = 256;  // limit, because the folder can be a home directory

/// Recognises a scene by keys at the start of lines, because configurations and material libraries lie beside scenes. Only the
/// beginning of the file is read, because a line may be longer than the memory.
bool is_like_a_scene(const std::filesystem::path& file) {
  std::string beginning(std::size_t{1} << 18, '\0');
  std::ifstream in(file, std::ios::binary);
  in.read(beginning.data(), static_cast<std::streamsize>(beginning.size()));
  beginning.resize(static_cast<std::size_t>(in.gcount()));
  std::istringstream lines(beginning);
  bool has_objects = false;
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("sonars:") || line.starts_with("world:")) return false;
    has_objects = has_objects || line.starts_with("objects:");
  }
  return has_objects;
}

std::vector<std::string> scenes_in(const std::filesystem::path& folder) {
  std::error_code ec;
  std::vector<std::string> names;
  int looked_at = 0;
  for (std::filesystem::directory_iterator it(folder.empty() ? "." : folder, ec), end; !ec && it != end; it.increment(ec)) {
    if (++looked_at > most_looked_at) break;
    if (has_scene_name(it->path()) && it->is_regular_file(ec) && is_like_a_scene(it->path()))
      names.push_back(it->path().filename().string());
  }
  std::sort(names.begin(), names.end());  // the order of a folder is unspecified
  return names;
}

/// Returns the nearest of these names, ignoring extensions.
std::string nearest_of(const std::vector<std::string>& names, const std::filesystem::path& given) {
  std::vector<std::string> stems;
  for (const std::string& name : names) stems.push_back(std::filesystem::path(name).stem().string());
  const std::vector<std::string_view> candidates(stems.begin(), stems.end());
  const std::string_view near = text::nearest(given.stem().string(), candidates);
  for (std::size_t i = 0; i < candidates.size() && !near.empty(); ++i)
    if (candidates[i] == near) return names[i];
  return {};
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

std::string nearest_scene(const std::filesystem::path& given, const std::filesystem::path& directory) {
  const std::filesystem::path folder = given.parent_path();
  if (const std::string beside = nearest_of(scenes_in(directory / folder), given); !beside.empty())
    return (folder / beside).string();
  std::vector<std::string> known(built_in_scenes.begin(), built_in_scenes.end());
  for (const auto& shipped : shipped_folders())
    for (std::string& name : scenes_in(shipped)) known.push_back(std::move(name));
  return nearest_of(known, given);
}

std::string scene_folders(const std::filesystem::path& directory) {
  std::string text = directory.empty() ? "." : directory.string();
  for (const auto& folder : shipped_folders()) text += (&folder == &shipped_folders().back() ? " and " : ", ") + folder.string();
  return text;
}

}  // namespace sonar
