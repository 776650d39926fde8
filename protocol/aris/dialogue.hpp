// One controller's connection to an emulated ARIS: commands in, changes of settings and receivers out. The device never
// replies.
#pragma once

#include <memory>

#include "protocol/vendor.hpp"

namespace sonar::aris {

/// The state must outlive the dialogue.
std::unique_ptr<protocol::Dialogue> make_dialogue(const protocol::DeviceState& device);

/// The time in a text such as "2014-Jan-31 23:58:15", in UTC. nullopt: the text has another form.
std::optional<Time> parse_date_time(const std::string& text);

}  // namespace sonar::aris
