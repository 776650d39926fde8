// Teledyne BlueView on sonard's link (docs/protocols/blueview-link.md): device, driver, and codec for recordings. Clients of the
// device are the drop-in SDK libraries of clients/bvtsdk. The driver requests pings one by one.
#pragma once

#include <array>
#include <memory>

#include "protocol/blueview/link.hpp"
#include "protocol/host.hpp"

namespace sonar::blueview {

const protocol::Vendor& vendor();
/// Makes the dialogue with one host over BVE1: greeting, settings, triggers, subscription, keep-alives.
std::unique_ptr<protocol::Dialogue> make_dialogue(const protocol::DeviceState& device, Time now);
/// Returns the answer to a discovery datagram; empty for other datagrams.
protocol::Bytes answer_discovery(protocol::BytesView datagram, const protocol::DeviceState& device);

inline constexpr std::array<protocol::HostPort, 1> host_ports{{{protocol::HostPort::Kind::tcp, tcp_port}}};

/// Samples are linear. In pictures the brightest 1 % saturate, because otherwise weak samples would be black.
inline constexpr Shades shades{.per_mille = 990};

extern const protocol::Search search;

Result<std::unique_ptr<protocol::Host>> make_host(const protocol::Wanted& wanted);

recording::Codec codec();

}  // namespace sonar::blueview
