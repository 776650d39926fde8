// Finds the make that sent a recorded message, and the host's port that receives it.
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
/// nullopt: a client sent it, or no known make.
std::optional<SentBy> sender_of(const RecordedMessage& message);
/// The index of the port at which a host of the make receives messages of this carrier; nullopt: there is none.
std::optional<std::size_t> host_port(const protocol::Make& make, Carrier by);

/// The framing of the device's recorded stream; null if the stream also has bytes without it: those of a make without framing,
/// or of several ports, such as the replies of a port for commands.
inline const Framing* only_framing(const protocol::Make& make) {
  const auto streams = std::count_if(make.ports.begin(), make.ports.end(),
                                     [](const auto& port) { return port.kind == protocol::HostPort::Kind::tcp; });
  return streams > 1 ? nullptr : make.codec.framing;
}

}  // namespace sonar::recording
