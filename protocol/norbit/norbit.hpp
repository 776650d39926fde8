// NORBIT WBMS and its forward-looking version: the implementation of Vendor.
#pragma once

#include "protocol/vendor.hpp"

namespace sonar::norbit {

const protocol::Vendor& vendor();

}  // namespace sonar::norbit
