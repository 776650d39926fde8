// One client's conversation: commands and their responses, and the reports of dead reckoning.
#pragma once

#include "protocol/vendor.hpp"

namespace sonar::dvl {

/// The conversation in JSON over TCP.
std::unique_ptr<protocol::Dialogue> converse_in_json(const protocol::DeviceState& device, Time now);
/// The conversation in sentences on the serial line.
std::unique_ptr<protocol::Dialogue> converse_in_sentences(const protocol::DeviceState& device, Time now);

}  // namespace sonar::dvl
