// A SettingsOverride as the fire message that a driver would have sent for it.
// Pings made with it echo that message; called by the vendor.
#pragma once

#include "protocol/vendor.hpp"

namespace sonar::oculus {

/// Changes only the fields of the current fire message that are set. Refuses values that the product does not support.
Result<protocol::ChangeSettings> apply_override(const protocol::SettingsOverride& wanted, const protocol::DeviceState& device);

/// The nearest of the rates that a fire message can request, without standby.
PingRate nearest_rate(double rate_hz);

}  // namespace sonar::oculus
