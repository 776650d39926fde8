#include "protocol/control/json_pose.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "protocol/control/control_json.hpp"

namespace sonar::control {
namespace {

using nlohmann::json;
constexpr int deepest_pose = 8;
constexpr std::string_view byte_order_mark = "\xef\xbb\xbf";  // .NET writes one
constexpr double latest_timestamp_s = 1e-9 * static_cast<double>(largest_stamp_ns);

bool begins_object(std::string_view line) {
  const auto first = line.find_first_not_of(" \t\r\n");
  return first != std::string_view::npos && line[first] == '{';
}

template <std::size_t N>
Result<std::optional<std::array<double, N>>> numbers(const json& object, const char* key) {
  const auto found = object.find(key);
  if (found == object.end()) return std::optional<std::array<double, N>>{};
  const std::string wanted = std::string(key) + " must be a list of " + std::to_string(N) + " numbers";
  if (!found->is_array() || found->size() != N) return refused(wanted);
  std::array<double, N> values{};
  for (std::size_t i = 0; i < N; ++i) {
    if (!(*found)[i].is_number()) return refused(wanted);
    values[i] = (*found)[i].get<double>();
  }
  return std::optional(values);
}

Result<std::string> text_of(const json& object, const char* key) {
  const auto found = object.find(key);
  if (found == object.end()) return std::string();
  if (!found->is_string()) return refused(std::string(key) + " must be a string");
  return found->get<std::string>();
}

/// Returns the time of the sender's clock, which may have any origin: ArduPilot counts from the start of the simulation. Without
/// a time, the pose gets the time of its arrival.
Result<Stamp> stamp_of(const json& object) {
  const auto found = object.find("timestamp");
  if (found == object.end()) return Stamp{};
  if (!found->is_number()) return refused("timestamp must be a number of seconds");
  const double s = found->get<double>();
  if (!(std::abs(s) <= latest_timestamp_s)) return refused("timestamp must be a number of seconds below 4.5e9");
  return Stamp{ClockDomain::sim, static_cast<std::int64_t>(std::llround(s * 1e9))};
}

Result<Frame> frame_of(const json& object) {
  const auto name = text_of(object, "frame");
  if (!name) return tl::unexpected(name.error());
  if (name->empty() || *name == "NED_FRD") return Frame::ned_frd;
  if (*name == "ENU_FLU") return Frame::enu_flu;
  return refused("frame must be \"NED_FRD\" or \"ENU_FLU\"");
}

/// Returns the orientation of the body in the world, in the axes of the message, from `quaternion` or, if there is none, from
/// `attitude`.
Result<std::array<double, 4>> orientation_of(const json& object, std::string& fields, RollPitchYaw& sent_angles) {
  const auto quaternion = numbers<4>(object, "quaternion");
  if (!quaternion) return tl::unexpected(quaternion.error());
  const auto attitude = numbers<3>(object, "attitude");
  if (!attitude) return tl::unexpected(attitude.error());
  if (*quaternion) {
    fields += " quaternion";
    return **quaternion;
  }
  if (!*attitude) return refused("attitude [roll, pitch, yaw] or quaternion [w, x, y, z] is missing");
  for (const double angle : **attitude)
    if (!(std::abs(angle) <= 1e6)) return refused("attitude is NaN, infinite or above 1e6 rad");
  fields += " attitude";
  sent_angles = {(**attitude)[0], (**attitude)[1], (**attitude)[2]};
  const Quatd q = quat_from_rpy(sent_angles);
  return std::array<double, 4>{q.w, q.x, q.y, q.z};
}

/// Reads and checks a pose. `velocity` is in world axes (protobuf: body axes) and is rotated into body axes.
Result<PoseSample> sample_from(const json& object) {
  PoseSample sample;
  RawPose raw;
  const auto vehicle = text_of(object, "vehicle");
  if (!vehicle) return tl::unexpected(vehicle.error());
  const auto stamp = stamp_of(object);
  if (!stamp) return tl::unexpected(stamp.error());
  const auto frame = frame_of(object);
  if (!frame) return tl::unexpected(frame.error());
  const auto position = numbers<3>(object, "position");
  if (!position) return tl::unexpected(position.error());
  if (!*position) return refused("position is missing");
  sample.name = *vehicle;
  sample.stamp = *stamp;
  sample.fields = stamp->domain == ClockDomain::sim ? "timestamp position" : "position";
  raw.frame = *frame;
  raw.position_m = **position;
  const auto orientation = orientation_of(object, sample.fields, raw.sent_angles);
  if (!orientation) return tl::unexpected(orientation.error());
  raw.orientation_wxyz = *orientation;
  const auto velocity = numbers<3>(object, "velocity");
  if (!velocity) return tl::unexpected(velocity.error());
  auto checked_sample = checked(std::move(sample), raw);
  if (!checked_sample || !*velocity) return checked_sample;
  const auto& v = **velocity;
  for (const double component : v)
    if (!(std::abs(component) <= 1e4)) return refused("velocity is NaN, infinite or above 1e4 m/s");
  const Vec3d sent{v[0], v[1], v[2]};
  const Vec3d in_world = *frame == Frame::ned_frd ? enu_from_ned(sent) : sent;
  checked_sample->velocity_mps = rotate(conjugate(checked_sample->pose.orientation), in_world);
  checked_sample->fields += " velocity";
  return checked_sample;
}

}  // namespace

Result<PoseSample> parse_json_pose(std::string_view line) {
  if (line.size() > longest_line) return refused("line is longer than 4096 bytes");
  if (nests_deeper(line, deepest_pose)) return refused("JSON is nested deeper than 8 levels");
  const json object = json::parse(line.begin(), line.end(), nullptr, false);
  if (object.is_discarded()) return refused("line is not JSON");
  if (!object.is_object()) return refused("line is not a JSON object");
  return sample_from(object);
}

bool is_json_object(std::string_view line) {
  return begins_object(line) && line.size() <= longest_line && !nests_deeper(line, deepest_pose) &&
         json::accept(line.begin(), line.end());
}

void LineParser::feed(std::span<const std::byte> received) {
  buffer_.erase(0, start_);  // erases at once all lines that next() has returned
  start_ = 0;
  if (in_gap_) {  // the rest of a line whose start was lost
    const auto end = std::find(received.begin(), received.end(), std::byte{'\n'});
    if (end == received.end()) return;
    received = received.subspan(static_cast<std::size_t>(end - received.begin()) + 1);
    in_gap_ = false;
  }
  for (const std::byte b : received) buffer_.push_back(static_cast<char>(b));
}

// Keeps whole lines and drops the incomplete line, because its end is lost. The next bytes are from the middle of a line.
void LineParser::skip_gap() {
  begun_ = in_gap_ = true;
  const std::size_t last = buffer_.rfind('\n');
  const bool whole_lines = last != std::string::npos && last >= start_;
  if (!whole_lines) swallowing_ = false;
  buffer_.resize(whole_lines ? last + 1 : std::min(start_, buffer_.size()));
}

/// Skips a byte order mark at the start of the stream. Returns false if more bytes are needed to recognise one.
bool LineParser::begin() {
  if (begun_) return true;
  if (buffer_.size() < byte_order_mark.size() && byte_order_mark.starts_with(buffer_)) return false;
  if (buffer_.starts_with(byte_order_mark)) start_ = byte_order_mark.size();
  return begun_ = true;
}

// Returns the next line, but skips blank lines. An incomplete line waits for more bytes, up to longest_line.
std::optional<LineParser::Line> LineParser::next() {
  if (!begin()) return std::nullopt;
  while (true) {
    const std::size_t end = buffer_.find('\n', start_);
    if (end == std::string::npos) {
      // A line that is too long is reported once, as soon as it exceeds the limit; the rest of the line is skipped.
      const bool too_long = !swallowing_ && buffer_.size() - start_ > longest_line;
      if (!swallowing_ && !too_long) return std::nullopt;
      const bool object = begins_object(std::string_view(buffer_).substr(start_));
      buffer_.clear();
      start_ = 0;
      if (!too_long) return std::nullopt;
      swallowing_ = true;
      return Line{{}, true, object};
    }
    std::string text = buffer_.substr(start_, end - start_);
    start_ = end + 1;
    if (std::exchange(swallowing_, false)) continue;  // the end of a line that was reported as too long
    const bool object = begins_object(text);
    if (text.size() > longest_line) return Line{{}, true, object};
    if (!text.empty() && text.back() == '\r') text.pop_back();
    if (text.find_first_not_of(" \t") != std::string::npos) return Line{std::move(text), false, object};
  }
}

bool LineParser::may_become_object() const {
  if (!begun_) return true;
  const auto first = buffer_.find_first_not_of(" \t\r\n", start_);
  return first == std::string::npos || buffer_[first] == '{';
}

}  // namespace sonar::control
