// The small messages a device sends beside pings: status beacon, dummy, user configuration, log text.
// The beacon goes out by UDP, the others through a Dialogue's replies.
#pragma once

#include <string_view>

#include "protocol/oculus/messages.hpp"
#include "protocol/vendor.hpp"

namespace sonar::oculus {

/// 142 bytes.
wire::Bytes make_status(const protocol::DeviceState& device);
/// A bare header: keep-alive, and the acknowledgement of standby.
wire::Bytes make_dummy(std::uint16_t device_id);
/// The stored configuration, or the advertised address before one was stored.
wire::Bytes make_user_config(std::uint16_t device_id, const protocol::StoredAddress& stored, const protocol::DeviceState& device);
/// ASCII text, as the real device prints while it boots.
wire::Bytes make_log(std::uint16_t device_id, std::string_view text);

}  // namespace sonar::oculus
