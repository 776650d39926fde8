// A host's conversation with a Micron: keep-alives, reboot, parameters, and one scan line for each request.
#pragma once

#include <memory>

#include "protocol/vendor.hpp"

namespace sonar::micron {

std::unique_ptr<protocol::Dialogue> make_dialogue(const protocol::DeviceState& device, Time now);

}  // namespace sonar::micron
