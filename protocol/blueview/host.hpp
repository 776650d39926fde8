// The driver's side of a BlueView sonar on sonard's link (docs/protocols/blueview-link.md): it greets, sends settings and
// requests pings one by one.
#pragma once

#include <array>

#include "protocol/blueview/link.hpp"
#include "protocol/host.hpp"

namespace sonar::blueview {

inline constexpr std::array<protocol::HostPort, 1> host_ports{{{protocol::HostPort::Kind::tcp, tcp_port}}};

/// Samples are linear. The brightest 1 % saturate in pictures; otherwise weak samples would be black.
inline constexpr Shades shades{.per_mille = 990};

extern const protocol::Search search;

Result<std::unique_ptr<protocol::Host>> make_host(const protocol::Wanted& wanted);

recording::Codec codec();

}  // namespace sonar::blueview
