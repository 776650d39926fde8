// The two kinds of pose files (vehicle_path.hpp), read strictly: what is wrong is told with its line.
#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <optional>
#include <sstream>

#include "core/text/decimal.hpp"
#include "core/text/nearest.hpp"
#include "daemon/render/vehicle_path.hpp"

namespace sonar::render {
namespace {

constexpr double norm_allowed = 1e-3;  // of a quaternion; less is repaired
constexpr double farthest_m = 1e8;

using Words = std::vector<std::string_view>;

Words split(std::string_view line, bool commas) {
  Words words;
  std::size_t at = 0;
  const std::string_view blanks = " \t\r";
  while (at <= line.size()) {
    const std::size_t end = std::min(commas ? line.find(',', at) : line.find_first_of(blanks, at), line.size());
    std::string_view word = line.substr(at, end - at);
    while (!word.empty() && blanks.find(word.front()) != std::string_view::npos) word.remove_prefix(1);
    while (!word.empty() && blanks.find(word.back()) != std::string_view::npos) word.remove_suffix(1);
    if (commas || !word.empty()) words.push_back(word);
    at = end + 1;
  }
  return words;
}

enum Column { t, x, y, z, qw, qx, qy, qz, roll, pitch, yaw, columns };
constexpr std::array<std::string_view, columns> long_names{"t_s", "x_m", "y_m",      "z_m",       "qw",     "qx",
                                                           "qy",  "qz",  "roll_deg", "pitch_deg", "yaw_deg"};
constexpr std::array<std::string_view, columns> short_names{"t", "x", "y", "z", "qw", "qx", "qy", "qz", "roll", "pitch", "yaw"};
constexpr std::array<int, 8> tum_order{t, x, y, z, qx, qy, qz, qw};

class Reader {
 public:
  Reader(const std::string& name, PoseFrame asked) : name_(name), frame_(asked) { place_.fill(-1); }

  Result<std::vector<TimedPose>> run(std::string_view text) {
    for (std::size_t at = 0; at < text.size() && wrong_.empty();) {
      const std::size_t end = std::min(text.find('\n', at), text.size());
      ++line_;
      take(text.substr(at, end - at));
      at = end + 1;
    }
    if (wrong_.empty() && poses_.empty()) wrong_ = name_ + ": no poses; write one a line, see docs/render.md";
    if (!wrong_.empty()) return failure(ErrorKind::bad_data, wrong_);
    if (frame_ == PoseFrame::ned_frd)
      for (TimedPose& p : poses_) p.body_in_world = enu_flu_from_ned_frd(p.body_in_world);
    return std::move(poses_);
  }

 private:
  void complain(const std::string& what) {
    if (wrong_.empty()) wrong_ = name_ + ":" + std::to_string(line_) + ": " + what;
  }

  void take(std::string_view line) {
    const std::size_t begin = line.find_first_not_of(" \t\r");
    if (begin == std::string_view::npos) return;
    line.remove_prefix(begin);
    if (line.front() == '#') return take_comment(line);
    if (!begun_) {
      begun_ = true;
      commas_ = line.find(',') != std::string_view::npos;
      const Words words = split(line, commas_);
      if (commas_ || words.empty() || !text::parse_decimal(words.front())) return take_header(words);
      for (std::size_t i = 0; i < tum_order.size(); ++i) place_[static_cast<std::size_t>(tum_order[i])] = static_cast<int>(i);
      width_ = tum_order.size();
    }
    take_pose(split(line, commas_));
  }

  void take_comment(std::string_view line) {
    const std::size_t word = line.find("frame:");
    if (word == std::string_view::npos) return;
    const Words words = split(line.substr(word + 6), false);
    if (!words.empty() && words.front() == "NED_FRD")
      frame_ = PoseFrame::ned_frd;
    else if (!words.empty() && words.front() == "ENU_FLU")
      frame_ = PoseFrame::enu_flu;
    else
      complain("the frame must be ENU_FLU or NED_FRD");
  }

  void take_header(const Words& words) {
    width_ = words.size();
    for (std::size_t i = 0; i < words.size(); ++i) {
      std::size_t c = 0;
      while (c < columns && words[i] != long_names[c] && words[i] != short_names[c]) ++c;
      if (c == columns)
        return complain("unknown column \"" + std::string(words[i]) + "\"" +
                        text::suggestion(std::string(words[i]), {long_names.begin(), long_names.end()}, "columns"));
      if (place_[c] >= 0) return complain("column " + std::string(words[i]) + " stands twice");
      place_[c] = static_cast<int>(i);
    }
    for (const int needed : {t, x, y, z})
      if (!has(needed)) return complain("column " + std::string(long_names[static_cast<std::size_t>(needed)]) + " is missing");
    const int turns = has(qw) + has(qx) + has(qy) + has(qz);
    if (turns != 0 && turns != 4) complain("a quaternion needs qw, qx, qy and qz");
    if (turns != 0 && (has(roll) || has(pitch) || has(yaw))) complain("give a quaternion or angles, not both");
  }

  bool has(int column) const { return place_[static_cast<std::size_t>(column)] >= 0; }

  void take_pose(const Words& words) {
    if (words.size() != width_) return complain(std::to_string(words.size()) + " values instead of " + std::to_string(width_));
    const auto value = [&](int column) {
      if (!has(column)) return 0.0;
      const std::string_view word = words[static_cast<std::size_t>(place_[static_cast<std::size_t>(column)])];
      const auto number = text::parse_decimal(word);
      if (!number) complain(std::string("\"").append(word).append("\" is not a number").append(text::number_hint(word)));
      return number.value_or(0);
    };
    TimedPose p;
    p.time_s = value(t);
    p.body_in_world.position_m = {value(x), value(y), value(z)};
    if (has(qw)) {
      const Quatd q{value(qw), value(qx), value(qy), value(qz)};
      if (std::abs(std::sqrt(norm_squared(q)) - 1) > norm_allowed)
        return complain("the quaternion's norm is " + std::to_string(std::sqrt(norm_squared(q))) + ", it must be 1");
      p.body_in_world.orientation = normalized(q);
    } else {
      p.body_in_world.orientation =
          quat_from_rpy({rad_from_deg(value(roll)), rad_from_deg(value(pitch)), rad_from_deg(value(yaw))});
    }
    const Vec3d at = p.body_in_world.position_m;
    if (std::max({std::abs(at.x), std::abs(at.y), std::abs(at.z)}) > farthest_m) return complain("lies beyond 1e8 m");
    if (!poses_.empty() && p.time_s <= poses_.back().time_s) return complain("the time does not rise");
    poses_.push_back(p);
  }

  std::string name_;
  PoseFrame frame_;
  std::array<int, columns> place_{};
  std::size_t width_ = 0;
  std::size_t line_ = 0;
  bool begun_ = false, commas_ = false;
  std::vector<TimedPose> poses_;
  std::string wrong_;
};

}  // namespace

Result<std::vector<TimedPose>> parse_poses(std::string_view text, const std::string& name, PoseFrame asked) {
  return Reader(name, asked).run(text);
}

Result<std::vector<TimedPose>> load_poses(const std::filesystem::path& file, PoseFrame asked) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  if (!in || !(text << in.rdbuf()))
    return failure(ErrorKind::missing_file, "cannot read the poses in " + file.string() + "; is the file there and not empty?");
  return parse_poses(text.str(), file.string(), asked);
}

}  // namespace sonar::render
