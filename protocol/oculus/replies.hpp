// Makes the small messages that a device sends beside pings: status beacon, dummy, user configuration, log text.
// The beacon is sent by UDP, the others in a Dialogue's replies.
#pragma once

#include <string_view>

#include "protocol/oculus/messages.hpp"
#include "protocol/vendor.hpp"

namespace sonar::oculus {

/// The status beacon, 142 bytes.
wire::Bytes make_status(const protocol::DeviceState& device);
/// A message without payload: keep-alive, and acknowledgement of standby.
wire::Bytes make_dummy(std::uint16_t device_id);
/// The stored configuration; if none is stored, the advertised address.
wire::Bytes make_user_config(std::uint16_t device_id, const protocol::StoredAddress& stored, const protocol::DeviceState& device);
/// A log message with ASCII text, such as a real device sends while it boots.
wire::Bytes make_log(std::uint16_t device_id, std::string_view text);

}  // namespace sonar::oculus
