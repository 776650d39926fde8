// Sound Metrics ARIS (docs/protocols/aris.md): the device, the controller, which sends commands by TCP and receives frames by
// UDP, and the codec for recordings.
#pragma once

#include <array>
#include <memory>

#include "protocol/aris/messages.hpp"
#include "protocol/host.hpp"

namespace sonar::aris {

const protocol::Vendor& vendor();
/// One controller's connection: commands in, changes of settings and receivers out. The device never replies. The state must
/// outlive it.
std::unique_ptr<protocol::Dialogue> make_dialogue(const protocol::DeviceState& device);

/// Frames arrive at any free port (0); the controller sends the port number to the device by SET_FRAMESTREAM_RECEIVER.
inline constexpr std::array<protocol::HostPort, 2> host_ports{
    {{protocol::HostPort::Kind::tcp, command_port}, {protocol::HostPort::Kind::udp_listen, 0}}};

Result<std::unique_ptr<protocol::Host>> make_host(const protocol::Wanted& wanted);

recording::Codec codec();

/// The time in a text such as "2014-Jan-31 23:58:15", in UTC. nullopt: the text has another form.
std::optional<Time> parse_date_time(const std::string& text);

}  // namespace sonar::aris
