#include "daemon/config/read_trajectory.hpp"

#include <algorithm>

#include "core/base/regular_file.hpp"
#include "core/text/format.hpp"

namespace sonar {

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
  plan.trajectory = *trajectory;
  for (const auto& one : f.bodies)
    if (one.trajectory == *trajectory) plan.largest_angle = one.largest_angle;
  plan.origin = f.origin;
  plan.file = file.text(1024);
  plan.about = text::format("%s: %s, %s, %zu poses, %.3f s", plan.file.c_str(), std::string(name_of(f.format)).c_str(),
                            std::string(name_of(f.frame)).c_str(), (*trajectory)->size(), seconds((*trajectory)->duration()));
  if (f.unit != "seconds" || f.unit_by_steps) plan.about += ", stamps in " + std::string(f.unit);
  if (f.unit_by_steps) plan.about += " by their steps (a first line with names would define it: t_s x y z qx qy qz qw)";
  if (f.replaced > 0) plan.about += ", " + text::counted(f.replaced, "pose") + " replaced by the next of the same stamp";
  return plan;
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
