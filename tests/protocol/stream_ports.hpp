// The ports of a device at which its host has conversations.
#pragma once

#include <algorithm>
#include <utility>
#include <vector>

#include "protocol/host.hpp"

namespace sonar::protocol::test {

/// Returns the host's ports that have a conversation with the device: the index in make.ports, and the port of the device.
inline std::vector<std::pair<std::size_t, const Port*>> conversations_of(const Make& make) {
  if (make.is_by_udp()) return {{0, make.device->port(Port::Kind::udp_dialogue)}};
  std::vector<std::pair<std::size_t, const Port*>> all;
  for (std::size_t i = 0; i < make.ports.size(); ++i)
    for (const Port& port : make.device->ports())
      if (make.ports[i].kind == HostPort::Kind::tcp && port.kind == Port::Kind::tcp_stream && make.ports[i].number == port.number)
        all.emplace_back(i, &port);
  return all;
}

/// Returns the bytes of a ping for clients at this port, without the prefixes of their conversation; null if there are none.
inline std::shared_ptr<const Bytes> bytes_at(const Make& make, const Port& port, const Ping& ping, const DeviceState& state) {
  if (conversations_of(make).size() < 2) return make.device->frame(ping, state);
  auto own = make.device->datagrams(port, ping, state);
  return own.empty() ? nullptr : std::make_shared<const Bytes>(std::move(own.front()));
}

}  // namespace sonar::protocol::test
