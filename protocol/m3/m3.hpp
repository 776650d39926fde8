// Kongsberg Mesotech M3, as its program streams beam-formed data, as a Vendor.
#pragma once

#include "protocol/vendor.hpp"

namespace sonar::m3 {

const protocol::Vendor& vendor();

}  // namespace sonar::m3
