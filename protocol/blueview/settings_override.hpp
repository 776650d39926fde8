// Converts a SettingsOverride to the settings that a BlueView host would set.
#pragma once

#include "protocol/vendor.hpp"

namespace sonar::blueview {

/// Converts between per cent and the gain adjustment [dB]: 0 % is -48 dB, 100 % is 48 dB.
float gain_db_from(double percent);
double gain_percent_from(double gain_db);

/// The interval between pings, limited to 1 ms up to one hour. `rate_hz` must be above 0.
std::int32_t ping_interval_ms(double rate_hz);

/// Selects the head `wanted.mode`, if set, and changes on the active head only the fields that are set. Refuses values that the
/// product does not support.
Result<protocol::ChangeSettings> apply_override(const protocol::SettingsOverride& wanted, const protocol::DeviceState& device);

}  // namespace sonar::blueview
