// A host's conversation with a Ping360: it turns the head, and has a ping fired when that has arrived.
#pragma once

#include <memory>

#include "protocol/vendor.hpp"

namespace sonar::ping::ping360 {

std::unique_ptr<protocol::Dialogue> make_dialogue(const protocol::DeviceState& device, const protocol::Port& port, Time now);

}  // namespace sonar::ping::ping360
