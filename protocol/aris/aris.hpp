// Sound Metrics ARIS (docs/protocols/aris.md): device, controller, and codec for recordings. The controller sends commands over
// TCP and receives frames over UDP.
#pragma once

#include <array>
#include <memory>

#include "protocol/aris/messages.hpp"
#include "protocol/host.hpp"

namespace sonar::aris {

const protocol::Vendor& vendor();
/// Makes the dialogue with one controller. It converts commands to changes of settings and receivers. The device never
/// replies. `device` must outlive the dialogue.
std::unique_ptr<protocol::Dialogue> make_dialogue(const protocol::DeviceState& device);

/// Frames arrive at any free port (0); the controller sends the port number to the device in SET_FRAMESTREAM_RECEIVER.
inline constexpr std::array<protocol::HostPort, 2> host_ports{
    {{protocol::HostPort::Kind::tcp, command_port}, {protocol::HostPort::Kind::udp_listen, 0}}};

Result<std::unique_ptr<protocol::Host>> make_host(const protocol::Wanted& wanted);

recording::Codec codec();

/// Returns the time in a text such as "2014-Jan-31 23:58:15", in UTC; nullopt if the text has another form.
std::optional<Time> parse_date_time(const std::string& text);

}  // namespace sonar::aris
