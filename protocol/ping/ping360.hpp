// Ping360: a mechanically scanned single beam. It has one UDP dialogue, and answers the discovery of its Ethernet interface.
#pragma once

#include "protocol/vendor.hpp"

namespace sonar::ping::ping360 {

const protocol::Vendor& vendor();

}  // namespace sonar::ping::ping360
