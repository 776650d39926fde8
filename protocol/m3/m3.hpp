// The Kongsberg Mesotech M3: the implementation of Vendor. It sends the stream of beam-formed data that the maker's program
// sends to its clients.
#pragma once

#include "protocol/vendor.hpp"

namespace sonar::m3 {

const protocol::Vendor& vendor();

}  // namespace sonar::m3
