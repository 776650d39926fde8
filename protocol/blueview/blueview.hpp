// Teledyne BlueView behind the Vendor interface: what the daemon needs to serve the drop-in SDK libraries of clients/bvtsdk.
#pragma once

#include "protocol/vendor.hpp"

namespace sonar::blueview {

const protocol::Vendor& vendor();

}  // namespace sonar::blueview
