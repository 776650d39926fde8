// S500: an echo sounder with one narrow beam. TCP and UDP; a host requests single pings or a stream of them.
#pragma once

#include "protocol/vendor.hpp"

namespace sonar::ping::s500 {

const protocol::Vendor& vendor();

}  // namespace sonar::ping::s500
