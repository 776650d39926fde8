// One host's conversation over BVE1: greeting, settings, triggers, subscription, keep-alives (docs/protocols/blueview-link.md).
#pragma once

#include <memory>

#include "protocol/vendor.hpp"

namespace sonar::blueview {

std::unique_ptr<protocol::Dialogue> make_dialogue(const protocol::DeviceState& device, Time now);

/// The answer to a discovery datagram; empty for other datagrams.
protocol::Bytes answer_discovery(protocol::BytesView datagram, const protocol::DeviceState& device);

}  // namespace sonar::blueview
