// The controller's side of an ARIS (docs/protocols/aris.md). It sends commands by TCP and receives frames by UDP.
#pragma once

#include <array>

#include "protocol/aris/messages.hpp"
#include "protocol/host.hpp"

namespace sonar::aris {

/// Frames arrive at any free port (0); the controller sends the port number to the device by SET_FRAMESTREAM_RECEIVER.
inline constexpr std::array<protocol::HostPort, 2> host_ports{
    {{protocol::HostPort::Kind::tcp, command_port}, {protocol::HostPort::Kind::udp_listen, 0}}};

Result<std::unique_ptr<protocol::Host>> make_host(const protocol::Wanted& wanted);

recording::Codec codec();

}  // namespace sonar::aris
