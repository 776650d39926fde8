// Teledyne BlueView as a Vendor: serves the drop-in SDK libraries of clients/bvtsdk.
#pragma once

#include "protocol/vendor.hpp"

namespace sonar::blueview {

const protocol::Vendor& vendor();

}  // namespace sonar::blueview
