// The Oculus family: the implementation of Vendor (names, ports, options, settings, dialogue, ping, beacon).
#pragma once

#include "protocol/vendor.hpp"

namespace sonar::oculus {

const protocol::Vendor& vendor();

}  // namespace sonar::oculus
