// Encodes a Ping as the datagrams of a shot.
#pragma once

#include <vector>

#include "protocol/vendor.hpp"
#include "protocol/waterlinked/messages.hpp"
#include "protocol/waterlinked/settings.hpp"

namespace sonar::waterlinked {

/// The pixel of a linear strength: 100 log10(strength / 30), at most 255; 0 for strengths up to 30.
std::uint8_t strength_pixel(std::uint32_t linear);

RangeMessage range_message(const Ping& ping, const Settings& settings, const protocol::DeviceState& device);
StrengthMessage strength_message(const Ping& ping, const Settings& settings, const protocol::DeviceState& device);
/// The inertial samples since the previous shot; if that was long ago, those of one period of the mode.
ImuMessage imu_message(const Ping& ping, const Settings& settings, const protocol::DeviceState& device);

/// The datagrams of a shot: range image, strength image and, if enabled, IMU samples.
std::vector<Bytes> encode_shot(const Ping& ping, const Settings& settings, const protocol::DeviceState& device);

}  // namespace sonar::waterlinked
