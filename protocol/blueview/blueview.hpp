// Teledyne BlueView: the implementation of Vendor. Its clients are the drop-in SDK libraries of clients/bvtsdk.
#pragma once

#include "protocol/vendor.hpp"

namespace sonar::blueview {

const protocol::Vendor& vendor();

}  // namespace sonar::blueview
