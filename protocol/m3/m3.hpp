// The Kongsberg Mesotech M3: the device, which sends the stream of beam-formed data that the maker's program sends to its
// clients, the driver, and the codec for recordings.
#pragma once

#include "protocol/host.hpp"
#include "protocol/m3/messages.hpp"

namespace sonar::m3 {

const protocol::Vendor& vendor();

inline constexpr protocol::HostPort host_ports[]{{protocol::HostPort::Kind::tcp, tcp_port}};

/// Assumed: samples are amplitudes, which the maker's program shows in decibels. A square root looks similar and needs no lower
/// limit.
inline constexpr Shades shades{.gamma = 0.5f};

Result<std::unique_ptr<protocol::Host>> make_host(const protocol::Wanted& wanted);
recording::Codec codec();

}  // namespace sonar::m3
