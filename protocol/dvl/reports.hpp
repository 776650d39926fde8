// Writes and reads the lines that the device sends: JSON, one object per line.
#pragma once

#include <optional>
#include <string>

#include "protocol/dvl/measure.hpp"

namespace sonar::dvl {

using protocol::Bytes;
using protocol::BytesView;

inline constexpr std::string_view format_name = "json_v3.3", line_end = "\r\n";
inline constexpr std::size_t longest_line = 16384;

inline constexpr double nsd_dbm = -90;  // DOC: -88 to -97 in its example; unknown: assumed the same for all

/// Unix time, the unit of the reports.
std::int64_t microseconds(Time at);
/// The angles of the vehicle since the start of dead reckoning.
RollPitchYaw angles_of(const Reckoning& reckoning);
/// The bytes of the text and a line end.
Bytes line_of(std::string text);
Bytes velocity_line(const Measurement& measured, std::chrono::nanoseconds since_last, Time sent_at);
Bytes position_line(const Reckoning& reckoning, Time at);

struct VelocityReport {
  Vec3d velocity_mps;
  double altitude_m = -1;
  bool is_valid = false;
  double reflected_s = 0;  // time_of_validity
  struct Transducer {
    double distance_m = -1, rssi_dbm = 0;
    bool is_valid = false;
  };
  std::array<Transducer, beam_count> transducers;
};
struct Response {
  std::string to, error;
  bool success = false;
};
/// A line of the device. Both members are absent for lines of other kinds and for text that is not JSON.
struct Line {
  std::optional<VelocityReport> velocity;
  std::optional<Response> response;
};
Line read_line(BytesView line);

}  // namespace sonar::dvl
