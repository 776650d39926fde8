// Encodes a ping in the vendor's bytes: echo rules, sizes, bearings. Only this file converts azimuth (to port) to bearing (to
// starboard). Vendor::frame calls it once per ping; tests re-encode captured pings with the bare encoder.
#pragma once

#include <span>
#include <string_view>
#include <vector>

#include "protocol/oculus/fire.hpp"
#include "protocol/vendor.hpp"

namespace sonar::oculus {

/// Fixed part of either version. header.version selects the fields: versions below 2 have ping_start_counter instead of the
/// extension, the attitude and ping_start_time_s.
struct PingHead {
  PingResultV2 fixed;
  std::uint32_t ping_start_counter = 0;
};
struct PingBlocks {
  std::span<const std::int16_t> bearings_cdeg;  // [beams], 0.01 deg, positive to starboard
  std::span<const std::uint32_t> row_gains;     // [rows], or empty
  wire::BytesView samples;                      // [rows][beams], little-endian
};

/// Fills in payload size, image offset, image size and message size; no trailing bytes. row_count and beam_count must be set.
wire::Bytes encode_ping(PingHead head, const PingBlocks& blocks);

/// Bearing in 0.01 deg, positive to starboard, truncated towards 0 as in the captured pings.
std::int16_t bearing_cdeg_from_azimuth(double azimuth_rad);

/// The fire settings as the ping repeats them (docs/protocols/oculus.md, 5.5). `sound_speed_used` replaces a requested 0.
FireSettings echo_of(const FireSettings& asked, std::string_view gain_echo, double sound_speed_used_mps);

/// The whole ping result of `ping`. `fire`: the request under which the ping was made.
wire::Bytes encode_ping(const Ping& ping, const protocol::DeviceState& device, const FireRequest& fire);

}  // namespace sonar::oculus
