#include "core/motion/columns.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "core/base/letters.hpp"
#include "core/motion/stamp.hpp"
#include "core/text/decimal.hpp"
#include "core/text/nearest.hpp"

namespace sonar::motion {
namespace {

// Largest error of the norm of a quaternion or of a matrix row. Smaller errors are rounding errors, which are corrected.
constexpr double norm_allowed = 0.01;
constexpr double farthest = 1e8;  // m, m/s, rad/s
constexpr std::array<std::pair<int, std::string_view>, 4> units{
    {{9, "seconds"}, {6, "milliseconds"}, {3, "microseconds"}, {0, "nanoseconds"}}};
constexpr std::size_t longest_quoted = 40, longest_name = 64;

/// The error in a line; empty for a valid line.
using LineError = std::optional<std::string>;

LineError not_a_number(std::string_view word, const char* what = "a number") {
  return in_quotes(word) + " is not " + what + std::string(text::number_hint(word));
}

/// Reads a finite decimal number. Leading zeros are accepted, because they do not mean octal in tables.
std::optional<double> number(std::string_view word) {
  // from_chars accepts no plus sign.
  if (word.starts_with('+') && !word.starts_with("+-")) word.remove_prefix(1);
  double v = 0;
  const char* const last = word.data() + word.size();
  const auto end = std::from_chars(word.data(), last, v);
  if (end.ec != std::errc{} || end.ptr != last || !std::isfinite(v)) return std::nullopt;
  return v;
}

/// Column names that other programs write.
constexpr std::array<std::array<std::string_view, 2>, 10> other_names{{{"time", "t"},
                                                                       {"timestamp", "t"},
                                                                       {"stamp", "t"},
                                                                       {"time_s", "t_s"},
                                                                       {"time_ns", "t_ns"},
                                                                       {"timestamp_ns", "t_ns"},
                                                                       {"tx", "x"},
                                                                       {"ty", "y"},
                                                                       {"tz", "z"},
                                                                       {"timestamp_s", "t_s"}}};

std::string plain_name(std::string_view word) {
  if (word.size() > 1 && word.front() == '"' && word.back() == '"') word = word.substr(1, word.size() - 2);
  const std::string name = small_letters(word.substr(0, longest_name));
  for (const auto& [other, ours] : other_names)
    if (name == other) return std::string(ours);
  return name;
}

/// The largest absolute part, so that all three parts can be compared with one limit.
double largest(Vec3d v) { return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}); }

/// Quaternion of a rotation matrix. It is computed from its largest part, so that no divisor is small.
Quatd quat_from(const Rotation& r) {
  const auto& m = r.m;
  // 1 + trace is 4 w^2. If w is small, the largest diagonal part gives 4 x^2, 4 y^2 or 4 z^2, each at least 1.
  const double trace = m[0][0] + m[1][1] + m[2][2];
  if (trace > 0) return normalized({1 + trace, m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1]});
  if (m[0][0] >= m[1][1] && m[0][0] >= m[2][2])
    return normalized({m[2][1] - m[1][2], 1 + m[0][0] - m[1][1] - m[2][2], m[0][1] + m[1][0], m[0][2] + m[2][0]});
  if (m[1][1] >= m[2][2])
    return normalized({m[0][2] - m[2][0], m[0][1] + m[1][0], 1 + m[1][1] - m[0][0] - m[2][2], m[1][2] + m[2][1]});
  return normalized({m[1][0] - m[0][1], m[0][2] + m[2][0], m[1][2] + m[2][1], 1 + m[2][2] - m[0][0] - m[1][1]});
}

/// True if the rows have length 1 and are perpendicular and right-handed, within norm_allowed. Mirrored frames are rejected.
bool is_rotation(const Rotation& r) {
  const Vec3d a{r.m[0][0], r.m[0][1], r.m[0][2]}, b{r.m[1][0], r.m[1][1], r.m[1][2]}, c{r.m[2][0], r.m[2][1], r.m[2][2]};
  for (const Vec3d& row : {a, b, c})
    if (!(std::abs(length(row) - 1) <= norm_allowed)) return false;
  return largest({dot(a, b), dot(b, c), dot(c, a)}) <= norm_allowed && dot(cross(a, b), c) > 0;
}

/// True if a column contains latitudes or longitudes, according to its name in small letters.
bool is_of_degrees(std::string_view name) {
  if (name.ends_with("_deg")) name.remove_suffix(4);
  return name == "lat" || name == "lon" || name == "lng" || name == "latitude" || name == "longitude";
}

}  // namespace

// Names in the order of enum Column. The long names state the unit; the short names have the same unit.
const std::array<std::string_view, Columns::columns> Columns::long_names{
    "t_s",       "t_ns",    "x_m",    "y_m",    "z_m",    "qw",       "qx",       "qy",       "qz",  "roll_deg",
    "pitch_deg", "yaw_deg", "vx_mps", "vy_mps", "vz_mps", "wx_radps", "wy_radps", "wz_radps", "body"};
const std::array<std::string_view, Columns::columns> Columns::short_names{
    "t", "t_ns", "x", "y", "z", "qw", "qx", "qy", "qz", "roll", "pitch", "yaw", "vx", "vy", "vz", "wx", "wy", "wz", "body"};

std::string in_quotes(std::string_view word) {
  std::string out = "\"";
  // Replaces bytes of a broken file that could change a terminal.
  for (const char c : word.substr(0, longest_quoted)) out += c >= 0x20 && c < 0x7f ? c : '?';
  return out + (word.size() > longest_quoted ? "...\"" : "\"");
}

void Columns::put(std::span<const Column> order) {
  for (const Column c : order) place_[c] = static_cast<int>(count_++);
}

Columns Columns::tum() {
  Columns c;
  // Time [s], position [m], quaternion with w last.
  c.put(std::array{t, x, y, z, qx, qy, qz, qw});
  return c;
}

Columns Columns::euroc(std::size_t words) {
  Columns c;
  // Time [ns], position [m], quaternion with w first, velocity [m/s].
  c.put(std::array{t_ns, x, y, z, qw, qx, qy, qz});
  c.power_ = 0;
  if (words > c.count_) c.put(std::array{vx, vy, vz});
  // The biases of an IMU are counted as words and not read.
  c.count_ = std::max(c.count_, words);
  return c;
}

Columns Columns::kitti() {
  Columns c;
  // A row-major 3 x 4 matrix: the fourth column is the position [m].
  c.count_ = 12;
  c.matrix_ = true;
  return c;
}

LineError Columns::refuse_header(const Words& header, Columns& out) {
  out = Columns();
  out.count_ = header.size();
  bool has_degrees = false;
  for (std::size_t i = 0; i < header.size(); ++i) {
    // A header may mix both sets of names.
    std::string name = plain_name(header[i]);
    if (name == "t_ms" || name == "t_us") {
      out.power_ = name == "t_ms" ? 6 : 3;
      name = "t_s";
    }
    if (name == "t_ns") out.power_ = 0;
    out.says_unit_ = out.says_unit_ || name == "t_s" || name == "t_ns";
    const bool is_radians = name == "roll_rad" || name == "pitch_rad" || name == "yaw_rad";
    if (is_radians) name.replace(name.size() - 3, 3, "deg");
    std::size_t c = 0;
    while (c < columns && name != long_names[c] && name != short_names[c]) ++c;
    if (c == columns && is_of_degrees(name))
      return "column " + in_quotes(header[i]) + ": positions are metres; sonard_client.geodesy converts degrees (docs/poses.md)";
    if (c == columns) return "unknown column " + in_quotes(header[i]) + text::suggestion(name, long_names, "columns");
    if (out.place_[c] >= 0) return "column " + std::string(header[i]) + " appears twice";
    out.place_[c] = static_cast<int>(i);
    if (c != roll && c != pitch && c != yaw) continue;
    (is_radians ? out.radians_ : has_degrees) = true;
  }
  if (out.radians_ && has_degrees) return "give all angles in one unit: roll_rad, pitch_rad and yaw_rad, or all in degrees";
  return out.refuse_set();
}

LineError Columns::refuse_set() const {
  if (!has(t) && !has(t_ns)) return "column t_s is missing";
  if (has(t) && has(t_ns)) return "give the time once: t_s or t_ns";
  for (const Column c : {x, y, z})
    if (!has(c)) return "column " + std::string(long_names[c]) + " is missing";
  // A file must have all parts of a vector or quaternion, or none of them.
  const auto of = [this](std::initializer_list<Column> group) {
    return std::count_if(group.begin(), group.end(), [this](Column c) { return has(c); });
  };
  const auto quaternion = of({qw, qx, qy, qz});
  if (quaternion != 0 && quaternion != 4) return "a quaternion needs qw, qx, qy and qz";
  if (quaternion != 0 && of({roll, pitch, yaw}) != 0) return "give a quaternion or angles, not both";
  if (of({vx, vy, vz}) % 3 != 0) return "a velocity needs vx_mps, vy_mps and vz_mps";
  if (of({wx, wy, wz}) % 3 != 0) return "an angular velocity needs wx_radps, wy_radps and wz_radps";
  return std::nullopt;
}

LineError Columns::refuse_vector(const Words& words, Column first, const char* what, Vec3d& out) const {
  double* const parts[3] = {&out.x, &out.y, &out.z};
  for (int i = 0; i < 3; ++i) {
    const std::string_view text = word(words, static_cast<Column>(first + i));
    const auto value = number(text);
    if (!value) return not_a_number(text);
    *parts[i] = *value;
  }
  // No scene is as large as this limit. At 1e8 m a double still resolves 1e-8 m.
  if (largest(out) > farthest) return std::string(what) + " is beyond 1e8";
  return std::nullopt;
}

void Columns::guess_unit(const Words& words) {
  if (!has(t) || says_unit_) return;
  const std::string_view text = word(words, t);
  if (text.empty() || text.find_first_not_of("0123456789") != std::string_view::npos) return;
  // The unit is known only for numbers of 12 or more digits (times after 1973), because such seconds would exceed every stamp.
  if (text.size() < 12) return;
  power_ = text.size() <= 14 ? 6 : text.size() <= 17 ? 3 : 0;
}

bool Columns::peek(const Words& words, double& stamp, Vec3d& position_m, std::string_view& of) const {
  const auto t_number = number(word(words, has(t) ? t : t_ns));
  if (!t_number || refuse_vector(words, x, "", position_m)) return false;
  stamp = *t_number;
  of = has(body) ? word(words, body) : std::string_view();
  return true;
}

std::string_view Columns::unit() const {
  return std::find_if(units.begin(), units.end(), [&](const auto& unit) { return unit.first == power_; })->second;
}

LineError Columns::refuse_stamp(const Words& words, Row& out) const {
  const std::string_view text = word(words, has(t) ? t : t_ns);
  const auto stamp = nanoseconds_of(text, power_);
  if (!stamp) return not_a_number(text, ("a time in " + std::string(unit())).c_str());
  out.stamp_ns = *stamp;
  return std::nullopt;
}

LineError Columns::refuse_orientation(const Words& words, Row& out) const {
  std::array<double, 4> v{};
  const auto fill = [&](std::initializer_list<Column> group) -> LineError {
    std::size_t i = 0;
    for (const Column c : group) {
      // Angles without a column are 0. Quaternions always have all four columns.
      const auto value = has(c) ? number(word(words, c)) : 0.0;
      if (!value) return not_a_number(word(words, c));
      v[i++] = *value;
    }
    return std::nullopt;
  };
  if (!has(qw)) {
    if (auto wrong = fill({roll, pitch, yaw})) return wrong;
    if (std::max({std::abs(v[0]), std::abs(v[1]), std::abs(v[2])}) > farthest) return "an angle is beyond 1e8";
    const auto in_rad = [this](double angle) { return radians_ ? angle : rad_from_deg(angle); };
    const RollPitchYaw rpy{in_rad(v[0]), in_rad(v[1]), in_rad(v[2])};
    out.pose.orientation = quat_from_rpy(rpy);
    if (radians_) out.written = rpy;
    return std::nullopt;
  }
  if (auto wrong = fill({qw, qx, qy, qz})) return wrong;
  const Quatd q{v[0], v[1], v[2], v[3]};
  // Corrects a rounding error of the norm. With a larger error the columns do not hold a quaternion.
  const double norm = std::sqrt(norm_squared(q));
  if (norm == 0) return "the quaternion is zero";
  if (!(std::abs(norm - 1) <= norm_allowed)) return "the quaternion's norm is " + std::to_string(norm) + ", it must be 1";
  out.pose.orientation = normalized(q);
  return std::nullopt;
}

LineError Columns::refuse_matrix(const Words& words, Row& out) const {
  std::array<double, 12> v{};
  for (std::size_t i = 0; i < v.size(); ++i) {
    const auto value = number(words[i]);
    if (!value) return not_a_number(words[i]);
    v[i] = *value;
  }
  // Words 4, 8 and 12 are the position.
  const Rotation turn{{{v[0], v[1], v[2]}, {v[4], v[5], v[6]}, {v[8], v[9], v[10]}}};
  out.pose.position_m = {v[3], v[7], v[11]};
  if (largest(out.pose.position_m) > farthest) return "the position is beyond 1e8";
  if (!is_rotation(turn)) return "the first three columns of the matrix are not a rotation";
  out.pose.orientation = quat_from(turn);
  return std::nullopt;
}

LineError Columns::refuse(const Words& words, Row& out) const {
  if (matrix_) return refuse_matrix(words, out);
  if (auto wrong = refuse_stamp(words, out)) return wrong;
  if (auto wrong = refuse_vector(words, x, "the position", out.pose.position_m)) return wrong;
  if (auto wrong = refuse_orientation(words, out)) return wrong;
  if (has(vx))
    if (auto wrong = refuse_vector(words, vx, "the velocity", out.velocity_mps)) return wrong;
  if (has(wx))
    if (auto wrong = refuse_vector(words, wx, "the angular velocity", out.angular_velocity_radps)) return wrong;
  if (!has(body)) return std::nullopt;
  out.body = word(words, body);
  // Names may be UTF-8; only control characters are errors.
  const bool printable = std::none_of(out.body.begin(), out.body.end(), [](char c) { return (c >= 0 && c < 0x20) || c == 0x7f; });
  if (out.body.empty() || out.body.size() > longest_name || !printable)
    return "a body's name must have 1 to 64 printable characters";
  return std::nullopt;
}

}  // namespace sonar::motion
