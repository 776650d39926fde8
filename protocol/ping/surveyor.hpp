// Surveyor 240-16: a multibeam echo sounder that sends points of the bottom, over TCP and UDP.
#pragma once

#include "protocol/vendor.hpp"

namespace sonar::ping::surveyor {

const protocol::Vendor& vendor();

}  // namespace sonar::ping::surveyor
