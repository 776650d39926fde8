// A driver of a Micron, over TCP.
#pragma once

#include <array>

#include "protocol/host.hpp"

namespace sonar::micron {

inline constexpr std::uint16_t tcp_port = 4001;  // usual for serial-to-TCP converters
inline constexpr std::array<protocol::HostPort, 1> host_ports{{{protocol::HostPort::Kind::tcp, tcp_port}}};
Result<std::unique_ptr<protocol::Host>> make_host(const protocol::Wanted& wanted);
recording::Codec codec();

}  // namespace sonar::micron
