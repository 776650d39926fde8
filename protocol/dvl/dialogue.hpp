// One client's conversation: commands and their responses, and the reports of dead reckoning.
#pragma once

#include "protocol/vendor.hpp"

namespace sonar::dvl {

std::unique_ptr<protocol::Dialogue> make_dialogue(const protocol::DeviceState& device, Time now);

}  // namespace sonar::dvl
