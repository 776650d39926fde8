// Micron: a mechanical scan, one beam whose head turns; a host requests each scan line over a serial line, here TCP.
#pragma once

#include "protocol/vendor.hpp"

namespace sonar::micron {

const protocol::Vendor& vendor();

}  // namespace sonar::micron
