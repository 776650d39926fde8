// The driver's side of a DVL, and its codec for recordings.
#pragma once

#include "protocol/host.hpp"

namespace sonar::dvl {

inline constexpr std::uint16_t tcp_port = 16171;
inline constexpr std::uint16_t serial_port = 4001;  // TCP port of the serial line: chosen, usual for servers of serial devices
inline constexpr protocol::HostPort host_ports[]{{protocol::HostPort::Kind::tcp, tcp_port}};

Result<std::unique_ptr<protocol::Host>> make_host(const protocol::Wanted& wanted);
recording::Codec codec();

}  // namespace sonar::dvl
