// The controller of an ARIS (docs/protocols/aris.md): commands at one port, frames at another.
#pragma once

#include <array>

#include "protocol/aris/messages.hpp"
#include "protocol/host.hpp"

namespace sonar::aris {

inline constexpr std::array<protocol::HostPort, 2> host_ports{
    {{protocol::HostPort::Kind::tcp, command_port}, {protocol::HostPort::Kind::udp_listen, 0}}};

Result<std::unique_ptr<protocol::Host>> make_host(const protocol::Wanted& wanted);

recording::Codec codec();

}  // namespace sonar::aris
