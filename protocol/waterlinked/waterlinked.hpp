// The Water Linked Sonar 3D-15: the implementation of Vendor. Settings over HTTP, images by UDP.
#pragma once

#include "protocol/vendor.hpp"

namespace sonar::waterlinked {

const protocol::Vendor& vendor();

}  // namespace sonar::waterlinked
