// The driver's side of the ping protocol (docs/protocols/ping.md): over UDP for a Ping360, over TCP for the others.
#pragma once

#include <array>

#include "protocol/host.hpp"

namespace sonar::ping {

namespace ping360 {
inline constexpr std::array<protocol::HostPort, 1> host_ports{{{protocol::HostPort::Kind::udp, 12345}}};
Result<std::unique_ptr<protocol::Host>> make_host(const protocol::Wanted& wanted);
recording::Codec codec();
}  // namespace ping360

namespace surveyor {
inline constexpr std::array<protocol::HostPort, 1> host_ports{{{protocol::HostPort::Kind::tcp, 62312}}};
Result<std::unique_ptr<protocol::Host>> make_host(const protocol::Wanted& wanted);
recording::Codec codec();
}  // namespace surveyor

namespace omniscan {
inline constexpr std::array<protocol::HostPort, 1> host_ports{{{protocol::HostPort::Kind::tcp, 51200}}};
Result<std::unique_ptr<protocol::Host>> make_host(const protocol::Wanted& wanted);
recording::Codec codec();
}  // namespace omniscan

namespace ping1d {
inline constexpr std::array<protocol::HostPort, 1> host_ports{{{protocol::HostPort::Kind::tcp, 9090}}};
Result<std::unique_ptr<protocol::Host>> make_host(const protocol::Wanted& wanted);
recording::Codec codec();
}  // namespace ping1d

namespace s500 {
inline constexpr std::array<protocol::HostPort, 1> host_ports{{{protocol::HostPort::Kind::tcp, 51200}}};
Result<std::unique_ptr<protocol::Host>> make_host(const protocol::Wanted& wanted);
recording::Codec codec();
}  // namespace s500

}  // namespace sonar::ping
