// The conversations of a Norbit: commands as lines of text, and ports that only send.
#pragma once

#include <memory>

#include "protocol/vendor.hpp"

namespace sonar::norbit {

/// `device` must outlive it.
std::unique_ptr<protocol::Dialogue> make_dialogue(const protocol::Port& port, const protocol::DeviceState& device, Time now);

}  // namespace sonar::norbit
