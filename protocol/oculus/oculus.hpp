// The Oculus family: the device, the driver, which sends fire messages and decodes ping results, and the codec for recordings.
#pragma once

#include <array>
#include <memory>

#include "protocol/host.hpp"
#include "protocol/oculus/fire.hpp"

namespace sonar::oculus {

const protocol::Vendor& vendor();
/// Makes the dialogue with one client. `device` must outlive it.
std::unique_ptr<protocol::Dialogue> make_dialogue(const protocol::DeviceState& device, Time now);

inline constexpr std::array<protocol::HostPort, 1> host_ports{{{protocol::HostPort::Kind::tcp, tcp_port}}};

/// Makes the fire message for the requested settings. Defaults: high frequency, 10 m, 10 Hz, 50 %, 512 beams, 8 bits. The rate is
/// the nearest that a fire message can request. Errors: usage if fire messages lack the mode or setting.
Result<FireRequest> fire_from(const protocol::Wanted& wanted);

/// Reads a status message. Returns nullopt for other datagrams.
std::optional<protocol::Announcement> announced(wire::BytesView datagram);

Result<std::unique_ptr<protocol::Host>> make_host(const protocol::Wanted& wanted);

/// The framing of the stream of an Oculus.
extern const recording::Framing framing;
recording::Codec codec();

}  // namespace sonar::oculus
