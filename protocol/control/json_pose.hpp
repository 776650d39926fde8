// Poses as JSON lines: the keys of ArduPilot's JSON simulator reply, so that a physics back-end can send a copy of its message.
// Source: ArduPilot libraries/SITL/examples/JSON (timestamp, position, attitude, quaternion, velocity).
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "protocol/control/pose_sample.hpp"

namespace sonar::control {

inline constexpr std::size_t longest_line = 4096;

/// Parses one line, with or without its newline. Unknown keys are ignored (ArduPilot sends an imu block); never throws.
///   timestamp   s, the sender's clock; absent = arrival
///   position    [n, e, d] m, required
///   attitude    [roll, pitch, yaw] rad, or quaternion [w, x, y, z]; one of the two is required
///   velocity    [n, e, d] m/s, world axes
///   frame       "NED_FRD" (default, as ArduPilot) or "ENU_FLU": then position, velocity and attitude are ENU and FLU
///   vehicle     name, may be absent when there is one vehicle
Result<PoseSample> parse_json_pose(std::string_view line);
/// True if the line is a JSON object, with any keys; other lines belong to another protocol.
bool is_json_object(std::string_view line);

/// Cuts a byte stream into lines. A line beyond the limit is discarded to its end and reported once. A byte order mark at the
/// start of the stream is skipped.
class LineParser {
 public:
  struct Line {
    std::string text;
    bool too_long = false;
    bool begins_object = false;  // true: the first character is a brace
  };
  void feed(std::span<const std::byte> received);
  std::optional<Line> next();
  /// Call it when a part of the stream was dropped. It discards the current line and all bytes up to the next line end, because
  /// they may belong to a dropped line.
  void skip_gap();
  /// True if the current line is blank so far or begins with a brace, so that it can be a JSON object, but not a request line of
  /// HTTP.
  bool may_become_object() const;

 private:
  bool begin();
  std::string buffer_;     // never longer than one line and one read
  std::size_t start_ = 0;  // start of the next line
  bool swallowing_ = false;
  bool begun_ = false;  // true: the stream has begun, so a byte order mark is no longer expected
  bool in_gap_ = false;
};

}  // namespace sonar::control
