// The products of the ping protocol (docs/protocols/ping.md), each with device, driver and codec of recordings.
#pragma once

#include <algorithm>
#include <array>
#include <string>

#include "core/text/format.hpp"
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

// Rates and settings of the devices and hosts of the family.

/// Returns the period for a rate above 0 [ms], limited to 1 to 30000.
inline double period_ms(double rate_hz) { return std::clamp(1000 / rate_hz, 1.0, 30000.0); }

inline constexpr double fastest_mps = 2000;  // highest sound speed that a host can set
/// Returns the time from a ping to its echo.
inline double travel_s(double range_m, double speed_mps) { return 2 * range_m / speed_mps; }

/// Returns a text for the log, such as "pings, 0.00 to 5.00 m, 600 results, 15 Hz, sound speed 1500 m/s". `rows`: "results".
inline std::string text_of(const PingSettings& s, const char* rows) {
  return text::format("%s, %.2f to %.2f m, %d %s, %.4g Hz, sound speed %g m/s", s.rate_hz > 0 ? "pings" : "standby",
                      s.range_start_m, s.range_m, s.range_bin_count, rows, static_cast<double>(s.rate_hz),
                      static_cast<double>(s.device_sound_speed_mps));
}

}  // namespace sonar::ping
