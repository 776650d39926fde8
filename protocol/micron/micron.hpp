// The Micron, a mechanically scanning sonar: its head turns one beam. A host requests each scan line over a serial line, here
// over TCP.
#pragma once

#include "protocol/vendor.hpp"

namespace sonar::micron {

const protocol::Vendor& vendor();

}  // namespace sonar::micron
