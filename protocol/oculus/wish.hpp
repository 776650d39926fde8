// What somebody who is no client wants of the sonar (protocol::Wish), as the fire message that a driver would have sent for it.
// Pings made with it echo that message; called by the vendor.
#pragma once

#include "protocol/vendor.hpp"

namespace sonar::oculus {

/// Changes only what is wished of the fire message that holds now. Refused: what this product cannot do.
Result<protocol::ChangeSettings> wished(const protocol::Wish& wish, const protocol::DeviceState& device);

}  // namespace sonar::oculus
