#include "daemon/config/scene_file.hpp"

#include <algorithm>
#include <fstream>
#include <sstream>
#include <system_error>
#include <vector>

#include "core/base/regular_file.hpp"
#include "core/scene/files/built_in_scenes.hpp"
#include "core/text/format.hpp"
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

using motion::Format;
using motion::Frame;
using motion::Plan;
using motion::Speed;
using text::Node;
using text::Range;

namespace {

constexpr double longest_start_s = 1e9;

motion::ReadOptions options_of(const TrajectoryKeys& keys) {
  motion::ReadOptions options;
  options.format = keys.format.choice_or(
      Format::automatic, {{"csv", Format::csv}, {"tum", Format::tum}, {"euroc", Format::euroc}, {"kitti", Format::kitti}});
  if (keys.frame) options.frame = keys.frame.choice<Frame>({{"ENU_FLU", Frame::enu_flu}, {"NED_FRD", Frame::ned_frd}});
  if (keys.rate_hz) options.rate_hz = keys.rate_hz.number(Range::between(0.001, 1e6));
  return options;
}

/// True if a text is a word, not a file name; an unknown word is probably a typing error.
bool is_word(const std::string& text) { return text.find_first_of("./") == std::string::npos; }

}  // namespace

Plan plan_for(const motion::TrajectoryFile& f, std::shared_ptr<const motion::Trajectory> trajectory, const std::string& name) {
  Plan plan{.trajectory = std::move(trajectory), .file = name, .origin = f.origin};
  for (const auto& one : f.bodies)
    if (one.trajectory == plan.trajectory) plan.largest_angle = one.largest_angle;
  plan.about = text::format("%s: %s, %s, %zu poses, %.3f s", name.c_str(), std::string(name_of(f.format)).c_str(),
                            std::string(name_of(f.frame)).c_str(), plan.trajectory->size(), seconds(plan.trajectory->duration()));
  if (f.unit != "seconds" || f.unit_by_steps) plan.about += ", stamps in " + std::string(f.unit);
  if (f.unit_by_steps) plan.about += " by their steps (a first line with names would define it: t_s x y z qx qy qz qw)";
  if (f.replaced > 0) plan.about += ", " + text::counted(f.replaced, "pose") + " replaced by the next of the same stamp";
  return plan;
}

TrajectoryKeys::TrajectoryKeys(text::Map& map)
    : file(map.optional("file")),
      format(map.optional("format")),
      frame(map.optional("frame")),
      rate_hz(map.optional("rate_hz")),
      body(map.optional("body")) {}

/// Reuses a file that was read before with the same options.
TrajectoryFiles::Named TrajectoryFiles::read(const Node& file, const motion::ReadOptions& options) {
  const std::string name = file.text(1024);
  if (name.empty()) return {};  // the error is reported already
  const std::filesystem::path path = folder_ / name;
  for (const Known& k : known_)
    if (k.path == path && k.options == options) return k.named;
  if (is_absent(path)) {
    std::error_code ec;
    // An empty folder means the working directory. For an absolute path the error names no folder.
    const auto folder = std::filesystem::absolute(folder_.empty() ? "." : folder_, ec).lexically_normal();
    const bool is_whole = std::filesystem::path(name).is_absolute();
    file.fail("no such file: \"" + name + "\"" + (is_whole ? "" : "; looked in " + folder.string()));
    return {};
  }
  auto loaded = motion::load_trajectories(path, options);
  if (!loaded) {
    file.fail(loaded.error().text);
    return {};
  }
  Named named{path.string(), std::make_shared<const motion::TrajectoryFile>(*std::move(loaded))};
  known_.push_back({path, options, named});
  return named;
}

TrajectoryFiles::Named TrajectoryFiles::read(const TrajectoryKeys& keys) { return read(keys.file, options_of(keys)); }

Plan TrajectoryFiles::plan_of(const Node& file, const Named& named, const std::string& asked, const std::string& body) {
  Plan plan;
  if (!named.file) return plan;
  const motion::TrajectoryFile& f = *named.file;
  const std::string wanted = asked.empty() && f.bodies.size() > 1 ? body : asked;
  const auto trajectory = motion::trajectory_of(f, named.name, wanted);
  if (!trajectory) {
    file.fail(trajectory.error().text);
    return plan;
  }
  return plan_for(f, *trajectory, file.text(1024));
}

/// Reads a text: with a dot or slash it is a file name, else it must be one of the words.
Plan TrajectoryFiles::read_words(const Node& node, const std::string& body, bool* orbits) {
  const std::string word = node.text(1024);
  if (word.empty() || !is_word(word)) return plan_of(node, read(node, {}), {}, body);
  const std::size_t chosen = node.choice_index(orbits != nullptr ? std::vector<std::string_view>{"none", "orbit"}
                                                                 : std::vector<std::string_view>{"none"});
  if (orbits != nullptr) *orbits = chosen == 1;
  return {};
}

/// Reads all keys even if the file is missing, so that errors in other keys are reported too.
Plan TrajectoryFiles::read_plan(const Node& node, const std::string& body, bool* orbits) {
  if (!node.present()) return {};
  if (!node.is_map()) return read_words(node, body, orbits);
  text::Map map = node.map();
  map.required("file");
  const TrajectoryKeys keys(map);
  const Node speed = map.optional("speed"), loop = map.optional("loop"), start_s = map.optional("start_s");
  motion::PlaybackRules rules;
  rules.loop = loop.boolean_or(false);
  rules.start = nanoseconds_from(start_s.number_or(0, Range::between(-longest_start_s, longest_start_s)));
  const double factor = speed.number_or(1, Range::between(Speed::slowest, Speed::fastest));
  rules.speed = Speed::from(factor).value_or(Speed{});
  if (!keys.file) return {};
  Plan plan = plan_of(keys.file, read(keys), keys.body.text_or({}, 64), body);
  plan.rules = rules;
  if (plan && rules.start > plan.trajectory->duration())
    start_s.fail("is beyond the end of the trajectory, " + text::format("%.3f s", seconds(plan.trajectory->duration())));
  if (plan && !(rules == motion::PlaybackRules{}))
    plan.about += text::format(", from %g s at %g x%s", seconds(rules.start), rules.speed.factor(), rules.loop ? ", looped" : "");
  return plan;
}

}  // namespace sonar
