// The datagrams of the Range Image Protocol: "RIP2", length, Snappy block, CRC-32; "RIP1" has no Snappy compression. Encodes a
// ping as the datagrams of a shot.
#pragma once

#include <optional>
#include <vector>

#include "protocol/vendor.hpp"
#include "protocol/waterlinked/messages.hpp"
#include "protocol/waterlinked/settings.hpp"
#include "protocol/wire/wire.hpp"

namespace sonar::waterlinked {

using wire::Bytes;
using wire::BytesView;

enum class Rip { one = 1, two = 2 };
inline constexpr std::size_t rip_overhead = 12;    // bytes around the content
inline constexpr std::size_t longest_rip = 65507;  // a packet is a datagram

Bytes rip_packet(BytesView content, Rip version = Rip::two);
/// The length that a packet states; 0: not the beginning of a packet.
std::size_t rip_length(BytesView beginning);
/// The content of a whole packet. nullopt: a wrong length, a wrong CRC, or invalid Snappy data.
std::optional<Bytes> rip_content(BytesView packet);

/// The pixel of a linear strength: 100 log10(strength / 30), at most 255; 0 for strengths up to 30.
std::uint8_t strength_pixel(std::uint32_t linear);

RangeMessage range_message(const Ping& ping, const Settings& settings, const protocol::DeviceState& device);
StrengthMessage strength_message(const Ping& ping, const Settings& settings, const protocol::DeviceState& device);
/// The inertial samples since the previous shot; if that was long ago, those of one period of the mode.
ImuMessage imu_message(const Ping& ping, const Settings& settings, const protocol::DeviceState& device);

/// The datagrams of a shot: range image, strength image and, if enabled, IMU samples.
std::vector<Bytes> encode_shot(const Ping& ping, const Settings& settings, const protocol::DeviceState& device);

}  // namespace sonar::waterlinked
