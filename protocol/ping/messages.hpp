// The little-endian messages of the ping protocol that the emulated devices use, and their frames. Source: the public
// definitions of bluerobotics/ping-protocol.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "protocol/message_fields.hpp"
#include "protocol/wire/wire.hpp"

namespace sonar::ping {

namespace means = protocol::means;

using wire::Bytes;
using wire::BytesView;

enum class Id : std::uint16_t {
  ack = 1,
  nack = 2,
  ascii_text = 3,
  device_information = 4,
  protocol_version = 5,
  general_request = 6,
  json_wrapper = 10,
  utc_request = 14,
  utc_response = 15,
  set_net_info = 17,
  set_device_id = 100,
  set_sound_speed = 116,
  water_stats = 118,
  attitude_report = 504,
  ping1d_set_device_id = 1000,
  ping1d_set_range = 1001,
  set_sound_speed_before = 1002,  // used by a Ping1D, an S500 and, in older definitions, other devices
  ping1d_set_mode_auto = 1003,
  ping1d_set_interval = 1004,
  ping1d_set_gain = 1005,
  ping1d_set_enable = 1006,
  s500_set_ping_params = 1015,
  ping1d_goto_bootloader = 1100,
  ping1d_firmware_version = 1200,
  ping1d_device_id = 1201,
  ping1d_voltage_5 = 1202,
  ping1d_sound_speed = 1203,
  ping1d_range = 1204,
  ping1d_mode_auto = 1205,
  ping1d_interval = 1206,
  ping1d_gain = 1207,
  ping1d_transmit_duration = 1208,
  ping1d_general_info = 1210,
  ping1d_distance_simple = 1211,
  ping1d_distance = 1212,
  ping1d_processor_temperature = 1213,
  ping1d_pcb_temperature = 1214,
  ping1d_enable = 1215,
  s500_distance2 = 1223,
  ping1d_profile = 1300,
  s500_profile6 = 1308,
  ping1d_continuous_start = 1400,
  ping1d_continuous_stop = 1401,
  ping360_set_device_id = 2000,
  os_ping_params = 2197,
  os_mono_profile = 2198,
  device_data = 2300,
  auto_device_data = 2301,
  reset = 2600,
  transducer = 2601,
  auto_transmit = 2602,
  motor_off = 2903,
  yz_point_data = 3011,
  atof_point_data = 3012,
  set_ping_parameters = 3023,
};

inline constexpr std::size_t header_size = 8, sum_size = 2;
inline constexpr std::size_t longest_payload = 65535;
inline constexpr std::size_t longest_request = 256;  // limit of the payload; the longest that a host has to send has 36 bytes

struct Header {
  std::array<std::uint8_t, 2> start{'B', 'R'};
  std::uint16_t length = 0;
  Id id{};
  std::uint8_t source = 0, destination = 0;
};
constexpr void fields(auto& visit, wire::Like<Header> auto& m) {
  visit("start", m.start, means::magic);
  visit("payload_length", m.length, means::payload_size);
  visit("message_id", m.id, means::message_type);
  visit("src_device_id", m.source, means::source_id);
  visit("dst_device_id", m.destination, means::destination_id);
}

/// Returns the whole frame of a message, addressed to any host. `source`: id of the device.
Bytes framed(Id id, std::uint8_t source, BytesView payload);
template <class M>
Bytes framed_message(Id id, std::uint8_t source, const M& message) {
  return framed(id, source, wire::bytes_of(message));
}
/// Corrects the checksums of frames whose fields were changed. `before`: the unchanged frames, of the same sizes.
void reseal(BytesView before, Bytes& frames);
Bytes ack(Id id, std::uint8_t source);
Bytes nack(Id id, std::uint8_t source, std::string_view why);

struct Frame {
  Header header;
  Bytes payload;  // empty if the checksum is wrong
  bool sum_is_right = true;
};

/// Finds the frames of a byte stream, which may arrive in pieces of any size. A header with a payload longer than `longest` does
/// not begin a frame. After a wrong checksum the search continues one byte after the start of that frame, so at most one
/// incomplete frame waits. In a datagram (`all_is_there`) the search also continues after the start of an incomplete frame. The
/// work is proportional to the number of bytes, even for hostile input: sums_ has the sum of all bytes before each position, so a
/// frame's checksum is the difference of two such sums.
class Framer {
 public:
  explicit Framer(std::size_t longest = longest_request, bool all_is_there = false)
      : longest_(longest), all_is_there_(all_is_there) {}
  void append(BytesView received);
  /// Call it when no more bytes will come.
  void end() { all_is_there_ = true; }
  std::optional<Frame> next();
  /// Returns the bytes of the last valid frame, which are valid until append().
  BytesView bytes() const { return BytesView(buffer_).subspan(begin_ - last_size_, last_size_); }
  /// Drops an incomplete frame.
  void drop_rest();
  std::size_t waiting_bytes() const { return buffer_.size() - begin_; }
  /// Returns the number of searched bytes since the start of the stream.
  std::uint64_t passed() const { return erased_ + begin_; }

 private:
  std::size_t longest_;
  bool all_is_there_;
  Bytes buffer_;
  std::vector<std::uint16_t> sums_{0};  // sum of the bytes before each position, modulo 2^16
  std::size_t begin_ = 0;               // start of the bytes not searched yet
  std::size_t last_size_ = 0;           // size of the last frame, which ends at begin_
  std::uint64_t erased_ = 0;
};

/// Returns the first frame of a complete message; nullopt if there is none, or if its sum is wrong.
std::optional<Frame> whole_frame(BytesView message);

/// True for ack, nack and texts, which only devices send. They get no answer, or two devices would answer each other without end.
constexpr bool is_of_device(Id id) { return id == Id::ack || id == Id::nack || id == Id::ascii_text; }

/// True if a datagram contains a valid frame of a host.
bool holds_frame(BytesView datagram);

struct DeviceInformation {
  std::uint8_t type = 0, revision = 0, major = 0, minor = 0, patch = 0, reserved = 0;
};
constexpr void fields(auto& visit, wire::Like<DeviceInformation> auto& m) {
  visit("device_type", m.type);
  visit("device_revision", m.revision);
  visit("firmware_version_major", m.major);
  visit("firmware_version_minor", m.minor);
  visit("firmware_version_patch", m.patch);
  visit("reserved", m.reserved);
}

struct ProtocolVersion {
  std::uint8_t major = 1, minor = 0, patch = 0, reserved = 0;
};
constexpr void fields(auto& visit, wire::Like<ProtocolVersion> auto& m) {
  visit("version_major", m.major);
  visit("version_minor", m.minor);
  visit("version_patch", m.patch);
  visit("reserved", m.reserved);
}

// ---- Ping360

struct Transducer {
  std::uint8_t mode = 1, gain = 0;
  std::uint16_t angle = 0;         // grad
  std::uint16_t transmit_us = 32;  // duration of the pulse
  std::uint16_t period = 80;       // period of samples, in units of 25 ns
  std::uint16_t khz = 740;
  std::uint16_t samples = 1024;
  std::uint8_t transmit = 0, reserved = 0;
  bool operator==(const Transducer&) const = default;
};
constexpr void fields(auto& visit, wire::Like<Transducer> auto& m) {
  visit("mode", m.mode);
  visit("gain_setting", m.gain);
  visit("angle", m.angle);
  visit("transmit_duration", m.transmit_us);
  visit("sample_period", m.period);
  visit("transmit_frequency", m.khz);
  visit("number_of_samples", m.samples);
  visit("transmit", m.transmit);
  visit("reserved", m.reserved);
}

/// A scan line, or the state of the head; `count` samples of one byte each follow.
struct DeviceData {
  std::uint8_t mode = 1, gain = 0;
  std::uint16_t angle = 0, transmit_us = 0, period = 0, khz = 0, samples = 0, count = 0;
};
constexpr void fields(auto& visit, wire::Like<DeviceData> auto& m) {
  visit("mode", m.mode);
  visit("gain_setting", m.gain, means::gain);
  visit("angle", m.angle, means::heading);
  visit("transmit_duration", m.transmit_us);
  visit("sample_period", m.period, means::range_resolution);
  visit("transmit_frequency", m.khz, means::frequency);
  visit("number_of_samples", m.samples, means::rows);
  visit("data_length", m.count, means::image_size);
}

struct AutoTransmit {
  std::uint8_t mode = 1, gain = 0;
  std::uint16_t transmit_us = 0, period = 0, khz = 0, samples = 0, start = 0, stop = 399;
  std::uint8_t steps = 1, delay_ms = 0;
};
constexpr void fields(auto& visit, wire::Like<AutoTransmit> auto& m) {
  visit("mode", m.mode);
  visit("gain_setting", m.gain);
  visit("transmit_duration", m.transmit_us);
  visit("sample_period", m.period);
  visit("transmit_frequency", m.khz);
  visit("number_of_samples", m.samples);
  visit("start_angle", m.start);
  visit("stop_angle", m.stop);
  visit("num_steps", m.steps);
  visit("delay", m.delay_ms);
}

/// A line of a scan that auto_transmit requested; `count` samples of one byte each follow.
struct AutoDeviceData {
  std::uint8_t mode = 1, gain = 0;
  std::uint16_t angle = 0, transmit_us = 0, period = 0, khz = 0, start = 0, stop = 0;
  std::uint8_t steps = 0, delay_ms = 0;
  std::uint16_t samples = 0, count = 0;
};
constexpr void fields(auto& visit, wire::Like<AutoDeviceData> auto& m) {
  visit("mode", m.mode);
  visit("gain_setting", m.gain, means::gain);
  visit("angle", m.angle, means::heading);
  visit("transmit_duration", m.transmit_us);
  visit("sample_period", m.period, means::range_resolution);
  visit("transmit_frequency", m.khz, means::frequency);
  visit("start_angle", m.start);
  visit("stop_angle", m.stop);
  visit("num_steps", m.steps);
  visit("delay", m.delay_ms);
  visit("number_of_samples", m.samples, means::rows);
  visit("data_length", m.count, means::image_size);
}

// ---- Surveyor 240

struct PingParameters {
  std::int32_t start_mm = 0, end_mm = 0;  // end 0 = the range follows the bottom
  float speed_mps = 1500;
  std::int16_t gain = -1, period_ms = 100;
  std::uint16_t reserved0 = 0;
  std::uint8_t reserved1 = 0, enable = 0, channel_data = 0, reserved2 = 0, yz = 1, atof = 1;
  std::int32_t hz = 240000;
  std::uint16_t steps = 400, reserved3 = 0;
  float pulse_steps = 1.5f;
  bool operator==(const PingParameters&) const = default;
};
constexpr void fields(auto& visit, wire::Like<PingParameters> auto& m) {
  visit("start_mm", m.start_mm);
  visit("end_mm", m.end_mm);
  visit("sos_mps", m.speed_mps);
  visit("gain_index", m.gain);
  visit("msec_per_ping", m.period_ms);
  visit("deprecated", m.reserved0);
  visit("diagnostic_injected_signal", m.reserved1);
  visit("ping_enable", m.enable);
  visit("enable_channel_data", m.channel_data);
  visit("reserved_for_raw_data", m.reserved2);
  visit("enable_yz_point_data", m.yz);
  visit("enable_atof_data", m.atof);
  visit("target_ping_hz", m.hz);
  visit("n_range_steps", m.steps);
  visit("reserved", m.reserved3);
  visit("pulse_len_steps", m.pulse_steps);
}

/// The points of a ping as angles and times; `points` structs AtofPoint follow.
struct AtofPointData {
  std::uint32_t power_up_ms = 0;
  std::uint64_t utc_ms = 0;
  float listening_s = 0, speed_mps = 0;
  std::uint32_t ping = 0, hz = 0;
  float pulse_s = 0;
  std::uint32_t flags = 0;
  std::uint16_t points = 0, reserved = 0;
};
constexpr void fields(auto& visit, wire::Like<AtofPointData> auto& m) {
  visit("pwr_up_msec", m.power_up_ms);
  visit("utc_msec", m.utc_ms, means::time);
  visit("listening_sec", m.listening_s);
  visit("sos_mps", m.speed_mps, means::sound_speed);
  visit("ping_number", m.ping, means::ping_id);
  visit("ping_hz", m.hz, means::frequency);
  visit("pulse_sec", m.pulse_s);
  visit("flags", m.flags);
  visit("num_points", m.points, means::beams);
  visit("reserved", m.reserved);
}
struct AtofPoint {
  float angle_rad = 0, two_way_s = 0;  // angle from straight down, positive to port; two-way travel time
  std::array<std::uint32_t, 2> reserved{};
};
constexpr void fields(auto& visit, wire::Like<AtofPoint> auto& m) {
  visit("angle", m.angle_rad);
  visit("tof", m.two_way_s);
  visit("reserved", m.reserved);
}

/// The points of a ping; `points` pairs of y (to port) and z (up) [m] follow.
struct YzPointData {
  std::uint32_t power_up_ms = 0, ping = 0;
  float speed_mps = 0;
  std::array<float, 3> up{}, reserved0{};
  std::array<std::uint32_t, 10> reserved1{};
  float temperature_c = -1000, pressure_bar = -1000, heave_m = 0, start_m = 0, end_m = 0;
  std::uint16_t reserved2 = 0, points = 0;
};
constexpr void fields(auto& visit, wire::Like<YzPointData> auto& m) {
  visit("timestamp_msec", m.power_up_ms);
  visit("ping_number", m.ping);
  visit("sos_mps", m.speed_mps);
  visit("up_vec", m.up);
  visit("mag_vec", m.reserved0);
  visit("reserved", m.reserved1);
  visit("water_degC", m.temperature_c);
  visit("water_bar", m.pressure_bar);
  visit("heave_m", m.heave_m);
  visit("start_m", m.start_m);
  visit("end_m", m.end_m);
  visit("unused", m.reserved2);
  visit("num_points", m.points);
}

struct AttitudeReport {
  std::array<float, 3> up{}, reserved{};
  std::uint64_t utc_ms = 0;
  std::uint32_t power_up_ms = 0;
};
constexpr void fields(auto& visit, wire::Like<AttitudeReport> auto& m) {
  visit("up_vec", m.up);
  visit("reserved", m.reserved);
  visit("utc_msec", m.utc_ms);
  visit("pwr_up_msec", m.power_up_ms);
}

struct WaterStats {
  float temperature_c = 0, pressure_bar = 0;
};
constexpr void fields(auto& visit, wire::Like<WaterStats> auto& m) {
  visit("temp_C", m.temperature_c);
  visit("pressure_bar", m.pressure_bar);
}

struct UtcResponse {
  std::uint64_t utc_ms = 0;
  std::uint32_t accuracy_ms = 0;
};
constexpr void fields(auto& visit, wire::Like<UtcResponse> auto& m) {
  visit("utc_msec", m.utc_ms);
  visit("accuracy_msec", m.accuracy_ms);
}

struct NetInfo {
  std::uint32_t ntp_ip = 0, netmask = 0, gateway = 0;  // first octet in the lowest byte
};
constexpr void fields(auto& visit, wire::Like<NetInfo> auto& m) {
  visit("ntp_ip_address", m.ntp_ip);
  visit("subnet_mask", m.netmask);
  visit("gateway_ip", m.gateway);
}

}  // namespace sonar::ping
