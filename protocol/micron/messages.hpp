// The little-endian messages of a Micron's serial protocol, each described once, and their frames. Sources and meanings:
// docs/protocols/micron.md.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "protocol/message_fields.hpp"
#include "protocol/recorded/message_splitter.hpp"
#include "protocol/wire/wire.hpp"

namespace sonar::micron {

namespace means = protocol::means;

using wire::Bytes;
using wire::BytesView;

enum class Id : std::uint8_t {
  version_data = 1,
  head_data = 2,
  alive = 4,
  user_data = 6,
  reboot = 16,
  head_command = 19,
  send_version = 23,
  send_user = 24,
  send_data = 25,
  fpga_version_data = 57,
  fpga_calibration_data = 63,
  stop_alives = 66,
};

inline constexpr std::uint8_t line_feed = 0x0A, host_node = 255, usual_node = 2;
inline constexpr std::size_t frame_size = 14;       // size of a message without payload
inline constexpr std::size_t uncounted = 6;         // bytes that `length` does not count: the first 5 and the last
inline constexpr std::size_t longest_frame = 4096;  // the longest real frame, head data, has 1545 bytes

struct Header {
  std::uint8_t start = '@';
  std::array<std::uint8_t, 4> hex_length{};  // hexadecimal digits of the length
  std::uint16_t length = 0;
  std::uint8_t source = 0, destination = 0;
  std::uint8_t count = 0;  // length - 5; 0 in head data that is not split
  Id id{};
  std::uint8_t sequence = 0x80;  // 0x80 = the last packet of the message
  std::uint8_t node = 0;
};
constexpr void fields(auto& visit, wire::Like<Header> auto& m) {
  visit("start", m.start, means::magic);
  visit("hex_length", m.hex_length);
  visit("length", m.length, means::payload_size);
  visit("source", m.source, means::source_id);
  visit("destination", m.destination, means::destination_id);
  visit("count", m.count);
  visit("id", m.id, means::message_type);
  visit("sequence", m.sequence);
  visit("node", m.node);
}
inline constexpr std::size_t header_size = wire::wire_size<Header>();
static_assert(header_size == 13);

/// Bits of HeadCommand::control and HeadData::control.
namespace control {
inline constexpr std::uint16_t eight_bits = 1, continuous = 2, to_right = 4, inverted = 8, motor_off = 16, no_transmission = 32,
                               stare = 1 << 12;
}

struct HeadCommand {
  std::uint8_t kind = 1;  // 1: this layout; 0x1D: 16 more bytes follow
  std::uint16_t control = 0x2307;
  std::uint8_t device_type = 0x11;
  std::array<std::uint32_t, 4> carriers{};  // transmitter, receiver; no effect here
  std::uint16_t pulse_us = 0;
  std::uint16_t range_dm = 100;             // only displayed; upper 2 bits: the unit
  std::uint16_t left = 0, right = 0;        // 1/16 grad
  std::uint8_t ad_span = 255, ad_low = 0;   // window of 4-bit bins
  std::uint8_t gain = 105, gain2 = 105;     // 0 to 210
  std::array<std::uint16_t, 2> slope{};     // no effect here
  std::uint8_t motor_time = 25, step = 16;  // in units of 10 us; in 1/16 grad
  std::uint16_t interval = 52, bins = 400;  // interval of the bins, in units of 640 ns
  std::uint16_t most_samples = 500, lockout_us = 100, minor_axis = 1600;
  std::uint8_t major_axis = 1, control2 = 0;
  std::uint16_t scan_z = 0;
  bool operator==(const HeadCommand&) const = default;
};
constexpr void fields(auto& visit, wire::Like<HeadCommand> auto& m) {
  visit("v3b", m.kind);
  visit("hd_ctrl", m.control);
  visit("hd_type", m.device_type);
  visit("carriers", m.carriers);
  visit("pulse_length", m.pulse_us);
  visit("range_scale", m.range_dm);
  visit("left_limit", m.left);
  visit("right_limit", m.right);
  visit("ad_span", m.ad_span);
  visit("ad_low", m.ad_low);
  visit("gain_1", m.gain);
  visit("gain_2", m.gain2);
  visit("slopes", m.slope);
  visit("motor_time", m.motor_time);
  visit("step", m.step);
  visit("ad_interval", m.interval);
  visit("bins", m.bins);
  visit("max_ad_buf", m.most_samples);
  visit("lockout", m.lockout_us);
  visit("minor_axis", m.minor_axis);
  visit("major_axis", m.major_axis);
  visit("ctl2", m.control2);
  visit("scan_z", m.scan_z);
}
static_assert(wire::wire_size<HeadCommand>() == 52);
inline constexpr std::uint8_t whole_command = 0x01, long_command = 0x1D, reverse_command = 0x0F;

/// The front of a scan line; `size` bytes of bins follow.
struct HeadData {
  std::uint16_t total = 0;  // size of the payload, including the bins
  std::uint8_t device_type = 0, head_status = 0, sweep = 0;
  std::uint16_t control = 0, range_dm = 0;
  std::uint32_t carrier = 0;
  std::uint8_t gain = 0;
  std::uint16_t slope = 0;
  std::uint8_t ad_span = 0, ad_low = 0;
  std::uint16_t heading_offset = 0, interval = 0, left = 0, right = 0;
  std::uint8_t step = 0;
  std::uint16_t bearing = 0, size = 0;
};
constexpr void fields(auto& visit, wire::Like<HeadData> auto& m) {
  visit("total", m.total, means::message_size);
  visit("device_type", m.device_type, means::device_id);
  visit("head_status", m.head_status, means::device_status);
  visit("sweep_code", m.sweep, means::ping_status);
  visit("hd_ctrl", m.control, means::sample_type);
  visit("range_scale", m.range_dm, means::range);
  visit("carrier", m.carrier);
  visit("gain", m.gain, means::gain);
  visit("slope", m.slope);
  visit("ad_span", m.ad_span);
  visit("ad_low", m.ad_low);
  visit("heading_offset", m.heading_offset);
  visit("ad_interval", m.interval, means::range_resolution);
  visit("left_limit", m.left);
  visit("right_limit", m.right);
  visit("step", m.step);
  visit("bearing", m.bearing, means::heading);
  visit("data_bytes", m.size, means::image_size);
}
static_assert(wire::wire_size<HeadData>() == 31);

struct Alive {
  std::uint8_t lacks_parameters = 0;  // 0x80 = the head has no valid parameters
  std::uint32_t time_ms = 0;
  std::uint16_t bearing = 0;
  std::uint8_t head_info = 0;
};
constexpr void fields(auto& visit, wire::Like<Alive> auto& m) {
  visit("state", m.lacks_parameters);
  visit("time", m.time_ms);
  visit("motor_position", m.bearing);
  visit("head_info", m.head_info);
}
/// Bits of Alive::head_info.
namespace head_info {
inline constexpr std::uint8_t recentring = 1, centred = 2, motoring = 4, motor_on = 8, to_right = 16, scanning = 32,
                              no_parameters = 64, received_parameters = 128;
}

struct VersionData {
  std::uint8_t software = 0, info = 0;
  std::uint16_t serial = 0;
  std::uint32_t program_length = 0;
  std::uint16_t program_sum = 0;
  std::uint8_t node = usual_node;
};
constexpr void fields(auto& visit, wire::Like<VersionData> auto& m) {
  visit("software_version", m.software);
  visit("info_bits", m.info);
  visit("serial_number", m.serial);
  visit("program_length", m.program_length);
  visit("program_checksum", m.program_sum);
  visit("node_id", m.node);
}
static_assert(wire::wire_size<Alive>() == 8 && wire::wire_size<VersionData>() == 11);

/// Returns the whole frame. `source` or `destination` must be host_node.
Bytes framed(Id id, std::uint8_t source, std::uint8_t destination, BytesView payload);
inline Bytes from_head(Id id, BytesView payload) { return framed(id, usual_node, host_node, payload); }
inline Bytes from_host(Id id, BytesView payload) { return framed(id, host_node, usual_node, payload); }

struct Message {
  Header header;
  BytesView payload;  // part of the frame that was read
};
/// Reads a frame; returns nullopt if the bytes are not a whole frame.
std::optional<Message> read_frame(BytesView frame);
/// Reads a message from the front of the payload.
template <class M>
std::optional<M> read_front(BytesView payload) {
  M message;
  wire::Reader reader(payload);
  fields(reader, message);
  return reader.ok() ? std::optional(message) : std::nullopt;
}

extern const recording::Framing framing;

/// Packs bins of 4 bits, two in a byte, the nearer bin in the upper half if `upper_first`. A single last bin is padded with a 0.
Bytes packed(BytesView bins, bool upper_first);
Bytes unpacked(BytesView bytes);

}  // namespace sonar::micron
