// The Water Linked DVL A50 and A125, Doppler velocity logs: the device, the driver, and the codec for recordings.
#pragma once

#include "protocol/host.hpp"

namespace sonar::dvl {

const protocol::Vendor& vendor();
/// Makes the dialogue with one client in JSON over TCP: commands and responses, and the reports of dead reckoning.
std::unique_ptr<protocol::Dialogue> converse_in_json(const protocol::DeviceState& device, Time now);
/// Makes the same dialogue in sentences of the serial line.
std::unique_ptr<protocol::Dialogue> converse_in_sentences(const protocol::DeviceState& device, Time now);

inline constexpr std::uint16_t tcp_port = 16171;
inline constexpr std::uint16_t serial_port = 4001;  // TCP port of the serial line: chosen, usual for servers of serial devices
inline constexpr protocol::HostPort host_ports[]{{protocol::HostPort::Kind::tcp, tcp_port}};

Result<std::unique_ptr<protocol::Host>> make_host(const protocol::Wanted& wanted);
recording::Codec codec();

}  // namespace sonar::dvl
