// The products of the ping protocol (docs/protocols/ping.md), each with device, driver and codec of recordings.
#pragma once

#include <algorithm>
#include <array>

#include "protocol/host.hpp"

namespace sonar::ping {

/// Ping360: a mechanically scanned single beam. It has one UDP dialogue, and answers the discovery of its Ethernet interface.
namespace ping360 {
inline constexpr std::array<protocol::HostPort, 1> host_ports{{{protocol::HostPort::Kind::udp, 12345}}};
const protocol::Vendor& vendor();
Result<std::unique_ptr<protocol::Host>> make_host(const protocol::Wanted& wanted);
recording::Codec codec();
}  // namespace ping360

/// Surveyor 240-16: a multibeam echo sounder that sends points of the bottom, over TCP and UDP. Drivers use TCP.
namespace surveyor {
inline constexpr std::array<protocol::HostPort, 1> host_ports{{{protocol::HostPort::Kind::tcp, 62312}}};
const protocol::Vendor& vendor();
Result<std::unique_ptr<protocol::Host>> make_host(const protocol::Wanted& wanted);
recording::Codec codec();
}  // namespace surveyor

/// Omniscan 450: a side-scan sonar with one beam, narrow along the track and wide across it, over TCP and UDP. It pings as soon
/// as a host enables pings.
namespace omniscan {
inline constexpr std::array<protocol::HostPort, 1> host_ports{{{protocol::HostPort::Kind::tcp, 51200}}};
const protocol::Vendor& vendor();
Result<std::unique_ptr<protocol::Host>> make_host(const protocol::Wanted& wanted);
recording::Codec codec();
}  // namespace omniscan

/// Ping1D: an altimeter with one wide beam, over TCP and UDP. A host requests single measurements or a stream of measurements.
namespace ping1d {
inline constexpr std::array<protocol::HostPort, 1> host_ports{{{protocol::HostPort::Kind::tcp, 9090}}};
const protocol::Vendor& vendor();
Result<std::unique_ptr<protocol::Host>> make_host(const protocol::Wanted& wanted);
recording::Codec codec();
}  // namespace ping1d

/// S500: an echo sounder with one narrow beam, over TCP and UDP. A host requests single pings or a stream of pings.
namespace s500 {
inline constexpr std::array<protocol::HostPort, 1> host_ports{{{protocol::HostPort::Kind::tcp, 51200}}};
const protocol::Vendor& vendor();
Result<std::unique_ptr<protocol::Host>> make_host(const protocol::Wanted& wanted);
recording::Codec codec();
}  // namespace s500

// Conversion of a ping rate to a period, for devices and hosts of the family.

/// Returns the period for a rate above 0 [ms], limited to 1 to 30000.
inline double period_ms(double rate_hz) { return std::clamp(1000 / rate_hz, 1.0, 30000.0); }

}  // namespace sonar::ping
