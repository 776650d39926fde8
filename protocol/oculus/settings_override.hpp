// Converts a SettingsOverride to the fire message by which a driver would request the same settings. Pings with these settings
// echo that message.
#pragma once

#include "protocol/vendor.hpp"

namespace sonar::oculus {

/// Starts from the current fire message and changes only the fields that are set in `wanted`. Refuses values that the product
/// does not support.
Result<protocol::ChangeSettings> apply_override(const protocol::SettingsOverride& wanted, const protocol::DeviceState& device);

/// The nearest of the rates that a fire message can request, without standby.
PingRate nearest_rate(double rate_hz);

}  // namespace sonar::oculus
