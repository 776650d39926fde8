#include "protocol/sender.hpp"

#include <utility>

namespace sonar::recording {

std::optional<SentBy> sender_of(const RecordedMessage& message) {
  if (message.from != Origin::device) return std::nullopt;
  for (const protocol::Make& make : protocol::makes())
    if (auto sender = make.codec.sender(message)) return SentBy{&make, std::move(*sender)};
  return std::nullopt;
}

std::optional<std::size_t> host_port(const protocol::Make& make, Carrier by) {
  using Kind = protocol::HostPort::Kind;
  const auto takes = [by](const protocol::HostPort& port) {
    const bool by_udp = port.kind == Kind::udp || port.kind == Kind::udp_listen;
    return by == Carrier::datagram ? by_udp : port.kind == Kind::tcp;
  };
  const auto found = std::find_if(make.ports.begin(), make.ports.end(), takes);
  if (found != make.ports.end()) return static_cast<std::size_t>(found - make.ports.begin());
  // A host that connects over TCP also reads the datagrams of a sonar that serves the same port over UDP.
  const protocol::Port* const dialogue = make.device->port(protocol::Port::Kind::udp_dialogue);
  const bool by_either = by == Carrier::datagram && dialogue != nullptr && dialogue->number == make.ports.front().number;
  return by_either ? std::optional<std::size_t>(0) : std::nullopt;
}

}  // namespace sonar::recording
