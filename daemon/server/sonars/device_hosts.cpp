// Dialogues of a Device by datagrams: ports of kind udp_dialogue.
#include "daemon/config/addresses.hpp"
#include "daemon/server/sonars/device.hpp"

namespace sonar {

/// The host that sent last has the dialogue: there are no connections that would end it.
void Device::on_host_datagram(DatagramPort& at, const protocol::Port& port, const Endpoint& from, protocol::BytesView datagram) {
  if (stopping_ || !sonar_.vendor().is_request(port, datagram)) return;
  const Peer host{text_of(from), from.ip, from.port};
  StreamPointer dialogue = host_of(port);
  if (!dialogue)
    dialogue = begin_dialogue(at, port, host);
  else if (const Peer& last = sonar_.connections().find(dialogue->id())->peer; last.ip != host.ip || last.port != host.port)
    sonar_.hand_over(dialogue->id(), host);
  if (!dialogue) return;
  dialogue->heard();
  on_bytes(dialogue->id(), datagram);
}

/// Without a connection, that is how a host's end is noticed.
void Device::on_host_closed(const protocol::Port& port, const Endpoint& host) {
  const StreamPointer dialogue = host_of(port);
  if (!dialogue) return;
  if (const Peer& last = sonar_.connections().find(dialogue->id())->peer; last.ip == host.ip && last.port == host.port)
    dialogue->finish("its port is closed");
}

Device::StreamPointer Device::host_of(const protocol::Port& port) const {
  for (const StreamPointer& stream : streams_) {
    const Connection* const c = sonar_.connections().find(stream->id());
    if (c != nullptr && c->role == Role::client && c->port == &port && !c->finishing) return stream;
  }
  return nullptr;
}

/// Null: no place is free. A datagram does not wait for one.
Device::StreamPointer Device::begin_dialogue(DatagramPort& at, const protocol::Port& port, Peer host) {
  const ConnectionId id = ++last_connection_;
  perform(sonar_.on_connect(id, Role::client, host, network_.clock.now(), &port));
  const Connection* const connection = sonar_.connections().find(id);
  if (connection == nullptr || connection->state != Connection::State::served) {
    turned_away_ = Visit{host.name, "no place is free"};
    if (connection != nullptr) perform(sonar_.on_closed(id, "no place is free", network_.clock.now()));
    return nullptr;
  }
  report_visit(Role::client, VisitLog::Kind::connected, "client connected", {{"client", host.name}});
  parent_.on_client(*this, host.name, true, {});
  streams_.push_back(std::make_shared<DatagramStream>(*this, at.socket(), id, port.gap));
  streams_.back()->start();
  return streams_.back();
}

}  // namespace sonar
