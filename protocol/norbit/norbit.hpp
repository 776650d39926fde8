// NORBIT WBMS, and its forward-looking version, as a Vendor.
#pragma once

#include "protocol/vendor.hpp"

namespace sonar::norbit {

const protocol::Vendor& vendor();

}  // namespace sonar::norbit
