// The Water Linked Sonar 3D-15 (docs/protocols/waterlinked.md): the device and its client, with settings over HTTP and images
// over multicast, and the codec for recordings.
#pragma once

#include <array>

#include "protocol/host.hpp"
#include "protocol/vendor.hpp"
#include "protocol/waterlinked/messages.hpp"
#include "protocol/waterlinked/settings.hpp"

namespace sonar::waterlinked {

const protocol::Vendor& vendor();

inline constexpr std::uint16_t http_port = 80;
inline constexpr std::array<protocol::HostPort, 2> host_ports{
    {{protocol::HostPort::Kind::http, http_port},
     {protocol::HostPort::Kind::udp_listen, multicast_group.port, multicast_group.ip}}};

/// Makes a ping with a picture from above. Each column becomes a beam; each pixel puts its strength at its horizontal range.
/// Without `strengths` all returns are equally bright. Returns nullopt if the messages do not describe one image.
std::optional<protocol::HostPing> ping_from(const RangeMessage& ranges, const StrengthMessage* strengths);

Result<std::unique_ptr<protocol::Host>> make_host(const protocol::Wanted& wanted);

recording::Codec codec();

protocol::ResourceReply answer(const protocol::ResourceRequest& request, const protocol::DeviceState& device, Time now);

}  // namespace sonar::waterlinked
