// Writes and reads the lines that the device sends: JSON, one object per line, and the sentences of the serial line, which are
// comma-separated texts with a checksum.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "protocol/dvl/measure.hpp"

namespace sonar::dvl {

using protocol::Bytes;
using protocol::BytesView;

inline constexpr std::string_view format_name = "json_v3.3", line_end = "\r\n";
inline constexpr std::size_t longest_line = 16384;

/// Returns the UNIX time in microseconds, the unit of the reports.
std::int64_t microseconds(Time at);
/// Returns the angles of the vehicle since the start of dead reckoning.
RollPitchYaw angles_of(const Reckoning& reckoning);
/// Returns the bytes of the text and a line end.
Bytes line_of(std::string text);
Bytes velocity_line(const Measurement& measured, std::chrono::nanoseconds since_last, Time sent_at);
Bytes position_line(const Reckoning& reckoning, Time at);

/// The content of a velocity_line(). Times that a line of older software does not have are 0.
struct VelocityReport {
  Measurement measured;
  std::chrono::nanoseconds since_last{0};
  Time sent_at{};
};
/// The content of a position_line(). The axes of the reckoning are those of the vehicle at the start.
struct PositionReport {
  Reckoning reckoning;
  Time at{};
};
struct Response {
  std::string to, error;
  bool success = false;
  std::optional<bool> acoustics = {};  // in the answer to get_config, as is range_mode
  std::string range_mode = {};
};
/// A line of the device. All members are absent for lines of other kinds and for text that is not JSON.
struct Line {
  std::optional<VelocityReport> velocity = {};
  std::optional<PositionReport> position = {};
  std::optional<Response> response = {};
};
Line read_line(BytesView line);

/// Returns the CRC-8 with the polynomial 0x07 and the initial value 0.
std::uint8_t crc8(std::string_view text);
/// Returns the sentence with its checksum, as a line.
Bytes sentence_line(std::string_view sentence);

/// Returns the sentences of a ping; empty if `output` selects none.
Bytes velocity_sentences(const Measurement& measured, std::chrono::nanoseconds since_last, Time sent_at, SerialOutput output);
Bytes position_sentence(const Reckoning& reckoning, Time at);

}  // namespace sonar::dvl
