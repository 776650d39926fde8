// Sound Metrics ARIS: the implementation of Vendor.
#pragma once

#include "protocol/vendor.hpp"

namespace sonar::aris {

const protocol::Vendor& vendor();

}  // namespace sonar::aris
