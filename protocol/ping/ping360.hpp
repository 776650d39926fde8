// Ping360: a mechanically scanned single beam. One UDP dialogue, and the discovery of its Ethernet link.
#pragma once

#include "protocol/vendor.hpp"

namespace sonar::ping::ping360 {

const protocol::Vendor& vendor();

}  // namespace sonar::ping::ping360
