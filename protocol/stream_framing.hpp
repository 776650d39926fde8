// The framing of recorded streams.
#pragma once

#include <algorithm>

#include "protocol/host.hpp"

namespace sonar::recording {

/// The framing of the device's recorded stream; null if the stream also has bytes without it: those of a make without framing,
/// or of several ports, such as the replies of a port for commands.
inline const Framing* only_framing(const protocol::Make& make) {
  const auto streams = std::count_if(make.ports.begin(), make.ports.end(),
                                     [](const auto& port) { return port.kind == protocol::HostPort::Kind::tcp; });
  return streams > 1 ? nullptr : make.codec.framing;
}

}  // namespace sonar::recording
