// The protobuf messages of a Sonar 3D-15 as structs, serialised in their packet (waterlinked.proto), and the datagrams of the
// Range Image Protocol that carry them: "RIP2", length, Snappy block, CRC-32; "RIP1" has no Snappy compression.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/base/units.hpp"
#include "protocol/vendor.hpp"
#include "protocol/waterlinked/settings.hpp"
#include "protocol/wire/wire.hpp"

namespace sonar::waterlinked {

using wire::Bytes;
using wire::BytesView;

/// The fields that both images of a shot have.
struct Shot {
  Time at{};
  std::uint32_t sequence = 0;
  float speed_of_sound_mps = 0, range_m = 0;
  std::uint32_t frequency = 0;  // shots per second
  std::uint32_t width = 0, height = 0;
  float horizontal_deg = 0, vertical_deg = 0;
};
struct RangeMessage {
  Shot shot;
  float pixel_scale_m = 0;
  std::vector<std::uint32_t> pixels;  // row by row, lowest row first
};
struct StrengthMessage {
  Shot shot;
  std::vector<std::uint8_t> pixels;
};
struct ImuMessage {
  std::uint32_t sequence = 0;
  struct Sample {
    Time at{};
    std::array<float, 3> specific_force_mps2{}, rate_radps{};  // axes: forward, right, down
  };
  std::vector<Sample> samples;
};

Bytes packet_of(const RangeMessage& message);
Bytes packet_of(const StrengthMessage& message);
Bytes packet_of(const ImuMessage& message);

/// The content of a packet: at most one member is set; none if the packet is of another kind or unreadable.
struct Decoded {
  std::optional<RangeMessage> ranges;
  std::optional<StrengthMessage> strengths;
  std::optional<ImuMessage> imu;
};
Decoded decode(BytesView packet);

enum class Rip { one = 1, two = 2 };
inline constexpr std::size_t rip_overhead = 12;    // bytes around the content
inline constexpr std::size_t longest_rip = 65507;  // a packet is a datagram

Bytes rip_packet(BytesView content, Rip version = Rip::two);
/// Returns the length that a packet states; 0 if the bytes do not begin a packet.
std::size_t rip_length(BytesView beginning);
/// Returns the content of a whole packet; nullopt for a wrong length, a wrong CRC, or invalid Snappy data.
std::optional<Bytes> rip_content(BytesView packet);

/// Returns the pixel of a linear strength: 100 log10(strength / 30), at most 255; 0 for strengths up to 30.
std::uint8_t strength_pixel(std::uint32_t linear);

RangeMessage range_message(const Ping& ping, const Settings& settings, const protocol::DeviceState& device);
StrengthMessage strength_message(const Ping& ping, const Settings& settings, const protocol::DeviceState& device);
/// Makes the inertial samples since the previous shot; if that was long ago, those of one period of the mode.
ImuMessage imu_message(const Ping& ping, const Settings& settings, const protocol::DeviceState& device);

/// Makes the datagrams of a shot: range image, strength image and, if enabled, IMU samples.
std::vector<Bytes> encode_shot(const Ping& ping, const Settings& settings, const protocol::DeviceState& device);

}  // namespace sonar::waterlinked
