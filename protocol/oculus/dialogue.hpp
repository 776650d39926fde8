// One client's connection to an emulated Oculus: bytes and ticks in, events and replies out. No socket, no clock, no log.
#pragma once

#include <memory>

#include "protocol/vendor.hpp"

namespace sonar::oculus {

/// The state must outlive the dialogue.
std::unique_ptr<protocol::Dialogue> make_dialogue(const protocol::DeviceState& device, Time now);

}  // namespace sonar::oculus
