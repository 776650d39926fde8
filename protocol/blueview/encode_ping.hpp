// Encodes a Ping as the payload of PING_DATA: the vehicle's navigation data, and 16-bit samples, beam by beam from left to
// right, each beam from near to far.
#pragma once

#include "protocol/blueview/frames.hpp"
#include "protocol/blueview/head_settings.hpp"
#include "protocol/vendor.hpp"

namespace sonar::blueview {

/// Bits of the mask of navigation fields. The fields follow the mask, in the order of the bits.
enum NavField : std::uint16_t {
  nav_time = 1 << 0,              // f64, seconds since 1970 UTC
  nav_latitude = 1 << 1,          // f64, degrees
  nav_longitude = 1 << 2,         // f64, degrees
  nav_depth = 1 << 3,             // f32, metres
  nav_altitude = 1 << 4,          // f32, metres
  nav_pitch = 1 << 5,             // f32, degrees, bow up
  nav_roll = 1 << 6,              // f32, degrees, port up
  nav_heading = 1 << 7,           // f32, degrees from true north, clockwise
  nav_heading_velocity = 1 << 8,  // f32, m/s ahead
  nav_course = 1 << 9,            // f32, degrees
  nav_text = 1 << 10,             // text
};

enum class Compression : std::uint8_t { none = 0, deflate = 1 };

/// The part of the payload before the samples, with the navigation data that the daemon sends.
struct PingHead {
  std::int32_t head = 0;
  std::uint32_t number = 0;
  double utc_s = 0;  // time since 1970
  std::int32_t time_zone = 0;
  float start_m = 0, stop_m = 0;
  std::int32_t sound_speed_mps = 0;
  float fov_min_deg = 0, fov_max_deg = 0, bin_m = 0;
  std::uint16_t beams = 0, bins = 0;
  std::uint8_t format = 1;  // 1 = unsigned 16-bit samples
  Compression compression{};
  std::uint16_t nav_fields = nav_time | nav_depth | nav_pitch | nav_roll | nav_heading;
  double nav_time_s = 0;
  float depth_m = 0, pitch_deg = 0, roll_deg = 0, heading_deg = 0;
  std::uint32_t raw_length = 0;  // size of the samples, uncompressed
};
constexpr void fields(auto& visit, wire::Like<PingHead> auto& m) {
  visit("head", m.head, means::source_id);
  visit("number", m.number, means::ping_id);
  visit("t_utc", m.utc_s, means::time);
  visit("tz", m.time_zone);
  visit("start", m.start_m);
  visit("stop", m.stop_m, means::range);
  visit("c", m.sound_speed_mps, means::sound_speed);
  visit("fov_min", m.fov_min_deg);
  visit("fov_max", m.fov_max_deg);
  visit("bin_m", m.bin_m, means::range_resolution);
  visit("beams", m.beams, means::beams);
  visit("bins", m.bins, means::rows);
  visit("fmt", m.format, means::sample_type);
  visit("compression", m.compression);
  visit("nav_fields", m.nav_fields);
  visit("time", m.nav_time_s);
  visit("depth", m.depth_m);
  visit("pitch", m.pitch_deg, means::pitch);
  visit("roll", m.roll_deg, means::roll);
  visit("heading", m.heading_deg, means::heading);
  visit("raw_len", m.raw_length, means::image_size);
}

/// Implements Vendor::field() and Vendor::region() for a PING_DATA message, including its header.
std::optional<protocol::Field> locate(protocol::FieldName name, wire::BytesView ping);
std::optional<std::pair<std::size_t, std::size_t>> locate(protocol::Region region, wire::BytesView ping);

/// Returns the payload of PING_DATA. `settings`: the settings with which the ping was made.
wire::Bytes encode_ping(const Ping& ping, const protocol::DeviceState& device, const SonarSettings& settings);

}  // namespace sonar::blueview
