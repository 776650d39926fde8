// A host's conversation with a Ping1D: settings one by one, and measurements that are requested or streamed.
#pragma once

#include <memory>

#include "protocol/vendor.hpp"

namespace sonar::ping::ping1d {

std::unique_ptr<protocol::Dialogue> make_dialogue(const protocol::DeviceState& device, const protocol::Port& port, Time now);

}  // namespace sonar::ping::ping1d
