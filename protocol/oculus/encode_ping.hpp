// Encodes a ping as a ping result: sizes, echo of the request, and bearings, which are positive to starboard (our azimuths are
// positive to port). Vendor::frame calls it once per ping; tests encode captured pings again with the function for PingBlocks.
// This header also encodes the small messages that a device sends besides pings.
#pragma once

#include <optional>
#include <span>
#include <string_view>
#include <utility>

#include "protocol/oculus/fire.hpp"
#include "protocol/oculus/messages.hpp"
#include "protocol/vendor.hpp"

namespace sonar::oculus {

/// The fixed part of a ping result of any version. header.version selects the fields: versions below 2 have ping_start_counter
/// instead of the extension, the attitude and ping_start_time_s.
struct PingHead {
  PingResultV2 fixed;
  std::uint32_t ping_start_counter = 0;
};
struct PingBlocks {
  std::span<const std::int16_t> bearings_cdeg;  // [beams], 0.01 deg, positive to starboard
  std::span<const std::uint32_t> row_gains;     // [rows], or empty
  wire::BytesView samples;                      // [rows][beams], little-endian
};

/// Encodes a ping without trailing bytes, and fills in payload size, image offset, image size and message size. row_count and
/// beam_count must be set.
wire::Bytes encode_ping(PingHead head, const PingBlocks& blocks);

/// Returns the bearing in 0.01 deg, positive to starboard, truncated towards 0 as in the captured pings.
std::int16_t bearing_cdeg_from_azimuth(double azimuth_rad);

/// Returns the fire settings that the ping states (docs/protocols/oculus.md, 5.5). `sound_speed_used_mps` replaces a requested 0.
FireSettings echo_of(const FireSettings& asked, std::string_view gain_echo, double sound_speed_used_mps);

/// Returns the whole ping result of `ping`. `fire`: the request under which the ping was made.
wire::Bytes encode_ping(const Ping& ping, const protocol::DeviceState& device, const FireRequest& fire);

/// Implements Vendor::field; the offsets are those of messages.hpp. The version in the header selects the layout of a ping; an
/// empty message stands for version 2.
std::optional<protocol::Field> locate(protocol::Part part, protocol::FieldName name, wire::BytesView message);
/// Implements Vendor::region.
std::optional<std::pair<std::size_t, std::size_t>> locate(protocol::Region region, wire::BytesView ping);

/// Makes the status beacon, 142 bytes, sent over UDP. The messages below are a Dialogue's replies.
wire::Bytes make_status(const protocol::DeviceState& device);
/// Makes a message without payload: keep-alive, and acknowledgement of standby.
wire::Bytes make_dummy(std::uint16_t device_id);
/// Makes the message with the stored address; if none is stored, with the advertised one.
wire::Bytes make_user_config(std::uint16_t device_id, const protocol::StoredAddress& stored, const protocol::DeviceState& device);
/// Makes a log message with ASCII text, such as a real device sends while it boots.
wire::Bytes make_log(std::uint16_t device_id, std::string_view text);

}  // namespace sonar::oculus
