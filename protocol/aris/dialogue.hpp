// One controller's connection to an emulated ARIS: commands in, settings and receivers out. The device answers nothing.
#pragma once

#include <memory>

#include "protocol/vendor.hpp"

namespace sonar::aris {

/// The state must outlive the dialogue.
std::unique_ptr<protocol::Dialogue> make_dialogue(const protocol::DeviceState& device);

/// The time in a text such as "2014-Jan-31 23:58:15", read as UTC. nullopt: the text has another form.
std::optional<Time> parse_date_time(const std::string& text);

}  // namespace sonar::aris
