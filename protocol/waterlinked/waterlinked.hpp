// The Water Linked Sonar 3D-15 as a vendor: settings over HTTP, images by UDP.
#pragma once

#include "protocol/vendor.hpp"

namespace sonar::waterlinked {

const protocol::Vendor& vendor();

}  // namespace sonar::waterlinked
