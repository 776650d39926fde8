#include "protocol/oculus/encode_ping.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "core/base/geometry.hpp"
#include "core/sonar/water.hpp"
#include "core/text/ipv4.hpp"
#include "protocol/oculus/messages.hpp"
#include "protocol/oculus/settings.hpp"

namespace sonar::oculus {
namespace {

/// Added before the truncation to 0.01 deg, because a float near 65 deg has an error of 4e-6 deg: 29.99999 deg must give 3000.
/// All other bearings of the formula that fits the captured pings are farther from an integer than this.
constexpr double truncation_guard_cdeg = 1e-3;

/// Converts to the short form of versions 0 and 1, which has no extension and no attitude, and states the start time as a 32-bit
/// counter.
PingResultV1 version_1(const PingHead& head) {
  const PingResultV2& from = head.fixed;
  PingResultV1 to;
  to.header = from.header;
  to.fire = from.fire;
  to.ping_id = from.ping_id;
  to.status = from.status;
  to.frequency_hz = from.frequency_hz;
  to.temperature_c = from.temperature_c;
  to.pressure_bar = from.pressure_bar;
  to.sound_speed_mps = from.sound_speed_mps;
  to.ping_start_time = head.ping_start_counter;
  to.data_size = from.data_size;
  to.range_resolution_m = from.range_resolution_m;
  to.row_count = from.row_count;
  to.beam_count = from.beam_count;
  to.sizes = from.sizes;
  return to;
}

/// Appends the rows, nearest first. A row has a gain, if gains were requested, and the samples from port to starboard.
void append_image(wire::Bytes& out, const PingBlocks& blocks, std::size_t rows) {
  const std::size_t row_bytes = rows == 0 ? 0 : blocks.samples.size() / rows;
  wire::Writer write(out);
  for (std::size_t row = 0; row < rows; ++row) {
    if (!blocks.row_gains.empty()) write("rowGain", blocks.row_gains[row]);
    const auto samples = blocks.samples.subspan(row * row_bytes, row_bytes);
    out.insert(out.end(), samples.begin(), samples.end());
  }
}

DataSize data_size_from(int bits) {
  switch (bits) {
    case 8:
      return DataSize::bits8;
    case 16:
      return DataSize::bits16;
    case 24:
      return DataSize::bits24;
    default:
      return DataSize::bits32;
  }
}

std::uint16_t reply_version(const FireRequest& fire, std::string_view option) {
  if (option == "0") return 0;
  if (option == "1") return 1;
  if (option == "2") return 2;
  // MRG reads only the short form, BLU only the long form, so a ping has the version of the fire message.
  return std::min<std::uint16_t>(fire.version, 2);
}

void set_attitude(PingResultV2& fixed, const Quatd& vehicle_in_world) {
  const RollPitchYaw angles = rpy_from_quat(vehicle_in_world);
  fixed.heading_deg = deg_from_rad(heading_rad(vehicle_in_world));
  fixed.pitch_deg = -deg_from_rad(angles.pitch_rad);  // a positive pitch_rad is bow down, a positive pitch_deg bow up
  fixed.roll_deg = deg_from_rad(angles.roll_rad);
}

void set_environment(PingResultV2& fixed, const PingRequest& request) {
  fixed.temperature_c = request.water.temperature_c;
  fixed.pressure_bar = absolute_pressure_bar(request.water, depth_from_z(request.sonar_in_world.position_m.z));
  set_attitude(fixed, request.vehicle_in_world.orientation);
}

/// Sets the time since power-up in the fields of both versions. CAP's 32-bit counter increases by 62 502 100 per ping at 16 Hz,
/// so its unit is a nanosecond and it overflows every 4.3 s; option ping_start_time_unit also allows microseconds.
void set_start_time(PingHead& head, std::chrono::nanoseconds since_power_up, std::string_view unit) {
  const auto microseconds = std::chrono::floor<std::chrono::microseconds>(since_power_up).count();
  head.fixed.ping_start_time_s = static_cast<double>(microseconds) * 1e-6;
  head.ping_start_counter = static_cast<std::uint32_t>(unit == "microseconds" ? microseconds : since_power_up.count());
}

/// Returns the sound speed that the device used. PingSettings have a float; if the request was applied unchanged, the ping must
/// state the client's double exactly.
double sound_speed_used(const FireSettings& asked, const PingSettings& settings) {
  const bool as_asked = static_cast<float>(asked.sound_speed_mps) == settings.device_sound_speed_mps;
  return as_asked ? asked.sound_speed_mps : static_cast<double>(settings.device_sound_speed_mps);
}

/// True for version 2, and for an empty `ping`, which stands for the layout with the most fields.
bool has_long_form(wire::BytesView ping) {
  MessageHeader header{.version = 2};
  wire::Reader reader(ping);
  if (!ping.empty()) fields(reader, header);
  return reader.ok() && header.version >= 2;
}

template <class Result>
std::optional<std::pair<std::size_t, std::size_t>> region_of(protocol::Region region, wire::BytesView ping) {
  Result head;
  wire::Reader reader(ping);
  fields(reader, head);
  std::pair<std::size_t, std::size_t> found{0, header_size};
  if (region != protocol::Region::header) {
    if (!reader.ok()) return std::nullopt;
    const std::size_t fixed_size = wire::wire_size<Result>();
    if (region == protocol::Region::metadata) found = {header_size, fixed_size - header_size};
    if (region == protocol::Region::bearings) found = {fixed_size, std::size_t{2} * head.beam_count};
    if (region == protocol::Region::image) found = {head.sizes.image_offset, head.sizes.image_size};
  }
  if (found.first + found.second > ping.size()) return std::nullopt;
  return found;
}

}  // namespace

wire::Bytes encode_ping(PingHead head, const PingBlocks& blocks) {
  PingResultV2& fixed = head.fixed;
  const bool long_form = fixed.header.version >= 2;
  const std::size_t fixed_size = long_form ? ping_v2_size : ping_v1_size;
  // The image begins at 2048, as in the captured pings. Drivers drop a ping whose sizes do not agree (docs/protocols/oculus.md,
  // 5.1): payload + 16 = offset + image = the bytes sent.
  const std::size_t offset = std::max<std::size_t>(image_offset, fixed_size + 2 * blocks.bearings_cdeg.size());
  const std::size_t image_size = blocks.samples.size() + 4 * blocks.row_gains.size();
  fixed.header.type = MessageType::ping_result;
  fixed.header.payload_size = static_cast<std::uint32_t>(offset + image_size - header_size);
  fixed.sizes = {static_cast<std::uint32_t>(offset), static_cast<std::uint32_t>(image_size),
                 static_cast<std::uint32_t>(offset + image_size)};

  wire::Bytes out;
  out.reserve(offset + image_size);
  if (long_form) {
    wire::append(out, fixed);
  } else {
    wire::append(out, version_1(head));
  }
  wire::Writer write(out);
  for (const std::int16_t& bearing : blocks.bearings_cdeg) write("bearing", bearing);
  out.resize(offset);  // zero filler
  append_image(out, blocks, fixed.row_count);
  return out;
}

/// Truncates towards 0, as the captured pings do (docs/protocols/oculus.md, 5.3). Bearings on the wire are positive to starboard.
std::int16_t bearing_cdeg_from_azimuth(double azimuth_rad) {
  const double bearing_cdeg = -100 * deg_from_rad(azimuth_rad);
  return static_cast<std::int16_t>(std::trunc(bearing_cdeg + std::copysign(truncation_guard_cdeg, bearing_cdeg)));
}

FireSettings echo_of(const FireSettings& asked, std::string_view gain_echo, double sound_speed_used_mps) {
  FireSettings echo = asked;
  echo.gain_percent = echoed_gain_percent(asked, gain_echo);
  if (asked.sound_speed_mps == 0) echo.sound_speed_mps = sound_speed_used_mps;  // for 0 the device chooses
  return echo;
}

// Everything in a ping is from the request with which it was made, not from the present settings, because drivers compare request
// and ping.
wire::Bytes encode_ping(const Ping& ping, const protocol::DeviceState& device, const FireRequest& fire) {
  const PingSettings& settings = ping.request.settings;
  PingHead head;
  PingResultV2& fixed = head.fixed;
  fixed.header.source = device.id;
  fixed.header.version = reply_version(fire, text_option(device.options, option_name::reply_version));
  fixed.sound_speed_mps = sound_speed_used(fire.settings, settings);
  const std::string_view gain_echo = text_option(device.options, option_name::gain_echo);
  fixed.fire = echo_of(fire.settings, gain_echo, fixed.sound_speed_mps);
  if (settings.gain_assist && gain_echo == "used")
    fixed.fire.gain_percent = static_cast<double>(settings.gain_db) / db_per_percent;
  fixed.extension = fire.extension;
  fixed.ping_id = static_cast<std::uint32_t>(ping.request.number);
  fixed.frequency_hz = ping.mode().centre_hz;
  set_environment(fixed, ping.request);
  set_start_time(head, ping.request.fired_at - device.powered_up_at,
                 text_option(device.options, option_name::ping_start_time_unit));
  fixed.data_size = data_size_from(settings.format.bits);
  fixed.range_resolution_m = settings.range_bin_m;
  fixed.row_count = static_cast<std::uint16_t>(settings.range_bin_count);
  fixed.beam_count = static_cast<std::uint16_t>(settings.beam_count);

  std::vector<std::int16_t> bearings;
  for (const float azimuth_rad : ping.beam_azimuth_rad) bearings.push_back(bearing_cdeg_from_azimuth(azimuth_rad));
  assert(bearings.size() == fixed.beam_count);
  assert(ping.samples.size() * 8 ==
         std::size_t{fixed.row_count} * fixed.beam_count * static_cast<unsigned>(settings.format.bits));
  assert(!settings.format.row_gains || ping.row_gain.size() == fixed.row_count);
  if (!settings.format.row_gains) return encode_ping(std::move(head), {bearings, {}, ping.samples});
  if (text_option(device.options, option_name::row_gain) == "tvg")
    return encode_ping(std::move(head), {bearings, ping.row_gain, ping.samples});
  return encode_ping(std::move(head), {bearings, digital_row_gains(settings), ping.samples});
}

std::optional<protocol::Field> locate(protocol::Part part, protocol::FieldName name, wire::BytesView message) {
  if (part == protocol::Part::ping)
    return has_long_form(message) ? wire::locate<PingResultV2>(name, message) : wire::locate<PingResultV1>(name, message);
  return wire::locate<StatusMessage>(name, message);
}

std::optional<std::pair<std::size_t, std::size_t>> locate(protocol::Region region, wire::BytesView ping) {
  if (ping.empty()) return std::pair<std::size_t, std::size_t>{};
  return has_long_form(ping) ? region_of<PingResultV2>(region, ping) : region_of<PingResultV1>(region, ping);
}

namespace {

constexpr std::uint32_t main_firmware_runs = 3, main_connection = 1u << 7;  // APL aborts if bits 0 to 2 are 0 or 1
// unknown: versions of the real firmware; major 8 bits, minor 8, build 16. Assumed: 1.0 build 0.
constexpr std::uint32_t firmware_version = 0x01000000, firmware_date = 0;
// unknown: dstDeviceId of the status, 0xFFFF in the notes of ALD on a real M750d; assumed: 0, as in CAP's pings. No driver reads
// it.

MessageHeader header_for(MessageType type, std::uint16_t device_id, std::size_t message_size) {
  MessageHeader header;
  header.source = device_id;
  header.type = type;
  header.payload_size = static_cast<std::uint32_t>(message_size - header_size);
  return header;
}

}  // namespace

wire::Bytes make_status(const protocol::DeviceState& device) {
  StatusMessage status;
  status.header = header_for(MessageType::status, device.id, status_size);
  status.header.part_number = status.part_number = device.model->part_number;
  status.device_id = device.id;
  status.status = main_firmware_runs;
  if (text_option(device.options, option_name::status_bit7) == "set") status.status |= main_connection;
  status.arm0_version = status.arm1_version = status.bitfile_version = firmware_version;
  status.arm0_date = status.arm1_date = status.bitfile_date = firmware_date;
  status.ip_address = device.advertise_ip;
  status.ip_mask = device.netmask;
  status.connected_ip = device.connected_client;
  status.mac = device.mac;
  // All eight sensors read the temperature of the water. Warmer electronics would be realistic, but ENS commands standby at 35
  // degrees.
  status.temperature_c.fill(device.water.temperature_c);
  status.pressure_bar = absolute_pressure_bar(device.water, device.depth_m);
  return wire::bytes_of(status);
}

wire::Bytes make_dummy(std::uint16_t device_id) {
  return wire::bytes_of(DummyMessage{header_for(MessageType::dummy, device_id, header_size)});
}

wire::Bytes make_user_config(std::uint16_t device_id, const protocol::StoredAddress& stored,
                             const protocol::DeviceState& device) {
  UserConfigMessage config;
  config.header = header_for(MessageType::user_config, device_id, user_config_size);
  // The first octet is the most significant byte here, the reverse of the status message.
  config.ip_address = stored.ip != 0 ? stored.ip : text::number_from_ipv4(device.advertise_ip);
  config.ip_mask = stored.ip != 0 ? stored.netmask : text::number_from_ipv4(device.netmask);
  config.dhcp_enable = stored.dhcp ? 1 : 0;
  return wire::bytes_of(config);
}

wire::Bytes make_log(std::uint16_t device_id, std::string_view text) {
  wire::Bytes out = wire::bytes_of(header_for(MessageType::log, device_id, header_size + text.size()));
  std::transform(text.begin(), text.end(), std::back_inserter(out), [](char c) { return static_cast<std::byte>(c); });
  return out;
}

}  // namespace sonar::oculus
