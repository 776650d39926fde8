// Turns a SettingsOverride into the settings that a BlueView host would have made. The Vendor of BlueView calls this.
#pragma once

#include "protocol/vendor.hpp"

namespace sonar::blueview {

/// The gain adjustment for 0 to 100 % of its range.
float gain_db_from(double percent);
double gain_percent_from(double gain_db);

/// Changes only the fields that are set, of the head that is or becomes active. Refuses values that the product does not support.
Result<protocol::ChangeSettings> apply_override(const protocol::SettingsOverride& wanted, const protocol::DeviceState& device);

}  // namespace sonar::blueview
