// Omniscan 450: a side-scan, one beam narrow along the track and wide across it. TCP and UDP; pings come once a host enables
// them.
#pragma once

#include "protocol/vendor.hpp"

namespace sonar::ping::omniscan {

const protocol::Vendor& vendor();

}  // namespace sonar::ping::omniscan
