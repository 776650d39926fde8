// Sound Metrics ARIS as a Vendor.
#pragma once

#include "protocol/vendor.hpp"

namespace sonar::aris {

const protocol::Vendor& vendor();

}  // namespace sonar::aris
