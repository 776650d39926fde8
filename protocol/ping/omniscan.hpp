// Omniscan 450: a side-scan sonar with one beam, narrow along the track and wide across it. TCP and UDP; it pings as soon as a
// host enables pings.
#pragma once

#include "protocol/vendor.hpp"

namespace sonar::ping::omniscan {

const protocol::Vendor& vendor();

}  // namespace sonar::ping::omniscan
