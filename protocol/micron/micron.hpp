// The Micron, a mechanically scanning sonar, whose head turns one beam. A host requests each scan line over a serial line, here
// over TCP. This folder has the device, the driver, and the codec for recordings.
#pragma once

#include <array>
#include <memory>

#include "protocol/host.hpp"

namespace sonar::micron {

const protocol::Vendor& vendor();
/// Makes the dialogue with a host: keep-alives, reboot, parameters, and one scan line for each request.
std::unique_ptr<protocol::Dialogue> make_dialogue(const protocol::DeviceState& device, Time now);

inline constexpr std::uint16_t tcp_port = 4001;  // usual for serial-to-TCP converters
inline constexpr std::array<protocol::HostPort, 1> host_ports{{{protocol::HostPort::Kind::tcp, tcp_port}}};
Result<std::unique_ptr<protocol::Host>> make_host(const protocol::Wanted& wanted);
recording::Codec codec();

}  // namespace sonar::micron
