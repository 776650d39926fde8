// A host's conversation with a Ping360: each request turns the head, and the ping is fired when the head has arrived.
#pragma once

#include <memory>

#include "protocol/vendor.hpp"

namespace sonar::ping::ping360 {

std::unique_ptr<protocol::Dialogue> make_dialogue(const protocol::DeviceState& device, const protocol::Port& port, Time now);

}  // namespace sonar::ping::ping360
