// Finds the make of the sonar that sent a recorded message, and the port of a host that receives such messages.
#pragma once

#include <algorithm>
#include <cstddef>
#include <optional>

#include "protocol/host.hpp"
#include "protocol/recorded/recorded_message.hpp"

namespace sonar::recording {

struct SentBy {
  const protocol::Make* make = nullptr;
  Sender sender;
};
/// Returns the sender of a message; nullopt if a client sent it, or a sonar of an unknown make.
std::optional<SentBy> sender_of(const RecordedMessage& message);
/// Returns the index of the port at which a host of the make receives messages of this carrier; nullopt if there is none.
std::optional<std::size_t> host_port(const protocol::Make& make, Carrier by);

/// Returns the framing of the device's TCP bytes. Returns null if the make has no framing, or has several TCP ports: the bytes of
/// some ports, such as a port for commands, have none.
inline const Framing* common_framing(const protocol::Make& make) {
  const auto streams = std::count_if(make.ports.begin(), make.ports.end(),
                                     [](const auto& port) { return port.kind == protocol::HostPort::Kind::tcp; });
  return streams > 1 ? nullptr : make.codec.framing;
}

}  // namespace sonar::recording
