// A host's conversation with a Ping1D: single settings, and requested or streamed measurements.
#pragma once

#include <memory>

#include "protocol/vendor.hpp"

namespace sonar::ping::ping1d {

std::unique_ptr<protocol::Dialogue> make_dialogue(const protocol::DeviceState& device, const protocol::Port& port, Time now);

}  // namespace sonar::ping::ping1d
