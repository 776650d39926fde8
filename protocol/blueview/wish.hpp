// What somebody who is no host wants of the sonar (protocol::Wish), as the settings that a host would have made for it.
// Called by the vendor.
#pragma once

#include "protocol/vendor.hpp"

namespace sonar::blueview {

/// The gain adjustment that stands for 0 to 100 per cent of what can be turned.
float gain_db_from(double percent);

/// Changes only what is wished of the head that is active, or becomes so. Refused: what this product cannot do.
Result<protocol::ChangeSettings> wished(const protocol::Wish& wish, const protocol::DeviceState& device);

}  // namespace sonar::blueview
