// The Oculus family as a Vendor: names, ports, options, and the four translations (settings, dialogue, ping, beacon).
#pragma once

#include "protocol/vendor.hpp"

namespace sonar::oculus {

const protocol::Vendor& vendor();

}  // namespace sonar::oculus
