// NORBIT WBMS and its forward-looking version: the device, the driver, and the codec for recordings.
#pragma once

#include <memory>

#include "protocol/host.hpp"
#include "protocol/norbit/messages.hpp"

namespace sonar::norbit {

const protocol::Vendor& vendor();
/// The conversation at a port: commands as lines of text, or none at ports that only send. `device` must outlive it.
std::unique_ptr<protocol::Dialogue> make_dialogue(const protocol::Port& port, const protocol::DeviceState& device, Time now);

inline constexpr protocol::HostPort host_ports[]{{protocol::HostPort::Kind::tcp, bathymetry_port},
                                                 {protocol::HostPort::Kind::tcp, column_port},
                                                 {protocol::HostPort::Kind::tcp, command_port}};

/// Assumed: samples are amplitudes, which the maker's program shows in decibels. A square root looks similar and needs no lower
/// limit.
inline constexpr Shades shades{.gamma = 0.5f};

Result<std::unique_ptr<protocol::Host>> make_host(const protocol::Wanted& wanted);
recording::Codec codec();

}  // namespace sonar::norbit
