// The Water Linked DVL A50 and A125: Doppler velocity logs.
#pragma once

#include "protocol/vendor.hpp"

namespace sonar::dvl {

const protocol::Vendor& vendor();

}  // namespace sonar::dvl
