// The messages of an ARIS: availability beacon, commands, parts of a frame. Each is described once, with the field numbers of the
// vendor's published protocol (docs/protocols/aris.md); aris.proto has the same description, for readers and for tests.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "protocol/aris/protobuf.hpp"

namespace sonar::aris {

using wire::Bytes;
using wire::BytesView;

inline constexpr std::uint16_t beacon_port = 56124, command_port = 56888;
inline constexpr std::size_t longest_command = 4096;  // chosen; real commands have 4 to 60 bytes
inline constexpr std::size_t length_prefix = 4;       // length in front of a command: u32, big-endian

enum class SystemType : std::uint32_t { aris_1800 = 0, aris_3000 = 1, aris_1200 = 2 };
enum class Frequency : std::uint32_t { low = 0, high = 1 };

struct SoftwareVersion {
  std::uint32_t major = 2, minor = 8, build = 8711;
};
void fields(auto& visit, wire::Like<SoftwareVersion> auto& m) {
  visit(1, m.major);
  visit(2, m.minor);
  visit(3, m.build);
}
struct Words {
  std::vector<std::string> enabled;
};
void fields(auto& visit, wire::Like<Words> auto& m) { visit(1, m.enabled); }
struct Availability {
  std::uint32_t serial = 0;
  SystemType system{};
  SoftwareVersion software;
  std::uint32_t busy = 0;  // 0 = available, 1 = a controller is connected
  Words capabilities;
  std::uint32_t link = 1;  // 0 = HomePlug, 1 = Ethernet
  float cpu_c = 0;
  std::optional<std::uint32_t> power_down_reason;  // 0 = over-temperature
  float hot_limit_c = 0;
  std::uint32_t hot_limit_s = 0;
  std::uint32_t diver_held = 0;
  Words variants;
};
void fields(auto& visit, wire::Like<Availability> auto& m) {
  visit(1, m.serial);
  visit(2, m.system);
  visit(3, m.software);
  visit(4, m.busy);
  visit(5, m.capabilities);
  visit(7, m.link);
  visit(8, m.cpu_c);
  visit(9, m.power_down_reason);
  visit(10, m.hot_limit_c);
  visit(11, m.hot_limit_s);
  visit(12, m.diver_held);
  visit(13, m.variants);
}

enum class CommandType : std::uint32_t {
  set_date_time = 0,
  set_receiver = 1,
  set_stream = 2,
  set_acoustics = 3,
  set_salinity = 4,
  set_telephoto = 5,
  set_focus = 6,
  force_focus = 7,
  home_focus = 8,
  set_rotator_mount = 9,
  set_rotator_velocity = 10,
  set_rotator_acceleration = 11,
  set_rotator_position = 12,
  stop_rotator = 13,
  ping = 14,
  set_syslog_receiver = 15,
  power_down = 16,
};

struct DateTime {
  std::string text;  // such as "2014-Jan-31 23:58:15"
};
void fields(auto& visit, wire::Like<DateTime> auto& m) { visit(1, m.text); }
struct Receiver {
  std::uint32_t port = 0;
  std::string ip;  // empty = the controller's own; "0.0.0.0" stops the stream
};
void fields(auto& visit, wire::Like<Receiver> auto& m) {
  visit(1, m.port);
  visit(2, m.ip);
}
struct InterpacketDelay {
  bool enable = false;
  std::uint32_t microseconds = 0;
};
void fields(auto& visit, wire::Like<InterpacketDelay> auto& m) {
  visit(1, m.enable);
  visit(2, m.microseconds);
}
struct StreamSettings {
  std::optional<InterpacketDelay> delay;
};
void fields(auto& visit, wire::Like<StreamSettings> auto& m) { visit(1, m.delay); }
/// The fields of SET_ACOUSTICS, with times in microseconds as on the wire.
struct Acoustics {
  std::uint32_t cookie = 0;
  float frame_rate_hz = 0;
  std::uint32_t samples_per_beam = 0, start_delay_us = 0, cycle_us = 0, sample_period_us = 0, pulse_us = 0, ping_mode = 0;
  bool transmit = false;
  Frequency frequency{};
  bool high_voltage = false;
  float gain_db = 0;
  bool operator==(const Acoustics&) const = default;
};
void fields(auto& visit, wire::Like<Acoustics> auto& m) {
  visit(1, m.cookie);
  visit(2, m.frame_rate_hz);
  visit(3, m.samples_per_beam);
  visit(4, m.start_delay_us);
  visit(5, m.cycle_us);
  visit(6, m.sample_period_us);
  visit(7, m.pulse_us);
  visit(8, m.ping_mode);
  visit(9, m.transmit);
  visit(10, m.frequency);
  visit(11, m.high_voltage);
  visit(12, m.gain_db);
}
/// A message with one number: salinity (0, 15, 35), telephoto lens (0, 1), direction of the focus motor.
struct Choice {
  std::uint32_t value = 0;
};
void fields(auto& visit, wire::Like<Choice> auto& m) { visit(1, m.value); }
struct Focus {
  std::uint32_t position = 0;  // 0 to 1000; only controllers before 2.6 send it
  float range_m = 0;
};
void fields(auto& visit, wire::Like<Focus> auto& m) {
  visit(1, m.position);
  visit(2, m.range_m);
}

/// A command, with only the sub-messages that have an effect. A missing type means 0, because proto3 does not send zeros.
struct Command {
  CommandType type{};
  std::optional<DateTime> date_time;
  std::optional<Receiver> receiver;
  std::optional<StreamSettings> stream;
  std::optional<Acoustics> acoustics;
  std::optional<Choice> salinity, telephoto;
  std::optional<Focus> focus;
  std::optional<Words> ping;  // an empty message
};
void fields(auto& visit, wire::Like<Command> auto& m) {
  visit(1, m.type);
  visit(2, m.date_time);
  visit(3, m.receiver);
  visit(4, m.stream);
  visit(5, m.acoustics);
  visit(6, m.salinity);
  visit(7, m.telephoto);
  visit(8, m.focus);
  visit(16, m.ping);
}

/// One datagram of a frame; only the first has `header`. The views point into the datagram.
struct FramePart {
  std::int32_t frame_index = 0, total_size = 0;
  std::optional<BytesView> header;
  BytesView data;
  std::int32_t data_offset = 0;
};
void fields(auto& visit, wire::Like<FramePart> auto& m) {
  visit(1, m.frame_index);
  visit(2, m.total_size);
  visit(3, m.header);
  visit(4, m.data);
  visit(5, m.data_offset);
}

/// Returns the bytes of a command on the TCP connection: length and message.
Bytes framed(const Command& command);

/// Splits the stream of a controller, which arrives in pieces of any size, into commands. Keeps at most longest_command bytes.
class CommandFramer {
 public:
  void append(BytesView received);
  /// Returns the next whole message; the view is valid until the next append().
  std::optional<BytesView> next();
  /// True after a length above longest_command; the rest of the stream is then unreadable.
  bool broken() const { return broken_; }

 private:
  Bytes buffer_;
  std::size_t begin_ = 0;
  bool broken_ = false;
};

}  // namespace sonar::aris
