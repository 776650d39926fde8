#include "daemon/emulator/sonar/audience.hpp"

#include <algorithm>
#include <utility>

namespace sonar {
namespace {

constexpr std::size_t most_receivers = 16;  // limit for one list of receivers

bool is_client(const Connection& c) { return c.role == Role::client && c.state == Connection::State::served && !c.finishing; }

/// Drops pings that wait in a stream without receivers, because the next receiver must not get the pings of the previous one.
void drop_unreceived(Connections& connections) {
  for (Connection& c : connections.all())
    if (c.role == Role::stream && connections.receivers(c).empty()) c.outbox.drop_waiting_pings(DropReason::gone);
}

}  // namespace

// ---- slots

// In a take-over, the previous client begins to finish before the new connection is added, so the new connection is the newest.
Connection* Audience::admit(ConnectionId id, Role role, Peer peer, const protocol::Port* port, Faults::Admission by_fault,
                            Actions& actions) {
  using Verdict = Connections::Verdict;
  using Admission = Faults::Admission;
  // The rules for slots give a verdict, which a fault of clients may then change.
  Verdict verdict = stopping_ ? Verdict::refuse : connections_.verdict(role);
  const Admission admission = role == Role::client && !stopping_ ? by_fault : Admission::as_configured;
  if (admission == Admission::wait) verdict = Verdict::wait;
  if (admission == Admission::take_over && verdict != Verdict::serve && connections_.clients() > 0) verdict = Verdict::take_over;
  if (admission == Admission::refuse || admission == Admission::reset) verdict = Verdict::refuse;
  if (verdict == Verdict::refuse) {
    if (role == Role::client) ++sonar_.figures.refused_clients;
    actions.emplace_back(Refuse{id, admission == Admission::reset});
    return nullptr;
  }
  if (verdict == Verdict::take_over) {
    // The oldest client still gets the rest of its current message, but no longer counts as a client.
    Connection& oldest = *connections_.oldest_client();
    oldest.state = Connection::State::leaving;
    begin_finish(oldest, "another client took over", actions);
  }
  if (port == nullptr) port = sonar_.vendor.port(protocol::Port::Kind::tcp_stream);
  Connection& connection = connections_.add(id, role, std::move(peer), Connection::State::waiting, port);
  if (verdict != Verdict::wait) return &connection;
  actions.emplace_back(KeepWaiting{id});
  return nullptr;
}

void Audience::serve(Connection& connection, Time now, Actions& actions) {
  connection.state = Connection::State::served;
  connection.dialogue = sonar_.vendor.converse(*connection.port, sonar_.state, sonar_.unskipped(now));
  // Serve creates the session to which later actions refer, such as ReadFrom because of a fault.
  actions.emplace_back(Serve{connection.id});
  // Clients are numbered, for faults that act on one client; observers are not.
  if (connection.role != Role::observer) connection.number = ++sonar_.figures.clients;
}

void Audience::hand_over(ConnectionId id, Peer to) {
  Connection* const host = connections_.find(id);
  if (host == nullptr) return;
  host->peer = std::move(to);
  if (connections_.oldest_client() == host) sonar_.state.connected_client = host->peer.ip;
}

void Audience::on_membership() {
  const Connection* const oldest = connections_.oldest_client();
  sonar_.state.connected_client = oldest == nullptr ? protocol::Ipv4{} : oldest->peer.ip;
  drop_unreceived(connections_);
}

// ---- streams of datagrams

void Audience::open_stream(ConnectionId id, const protocol::Port& port) {
  const auto number = std::count_if(all().begin(), all().end(), [](const Connection& c) { return c.role == Role::stream; });
  Connection& stream = connections_.add(id, Role::stream, {}, Connection::State::served, &port);
  stream.receivers.push_back({.to = {}, .stream = static_cast<std::size_t>(number)});
  if (port.group.port != 0) stream.receivers.front().to.push_back(port.group);
}

// A client has its own list for each stream; a request over HTTP or UDP sets the device's list.
void Audience::set_receivers(Connection* from, protocol::Ipv4 ip, protocol::SetReceivers wanted) {
  Connection* const stream = connections_.stream(wanted.stream);
  if (stream == nullptr) return;
  if (wanted.to.size() > most_receivers) wanted.to.resize(most_receivers);
  for (protocol::Endpoint& to : wanted.to)
    if (to.ip == protocol::Ipv4{}) to.ip = ip;
  std::vector<protocol::SetReceivers>& lists = (from == nullptr ? *stream : *from).receivers;
  const auto same = std::find_if(lists.begin(), lists.end(), [&](const auto& list) { return list.stream == wanted.stream; });
  if (same == lists.end())
    lists.push_back(std::move(wanted));
  else
    *same = std::move(wanted);
  drop_unreceived(connections_);
}

void Audience::restore_receivers(protocol::SetReceivers initial) {
  if (Connection* const stream = connections_.stream(initial.stream)) stream->receivers = {std::move(initial)};
}

// ---- the end of a connection

void Audience::finish(Connection& connection) {
  if (!std::exchange(connection.finishing, true)) connection.outbox.drop_waiting_pings(DropReason::stop);
}

void Audience::begin_finish(Connection& connection, const std::string& why, Actions& actions) {
  if (connection.finishing) return;
  finish(connection);
  actions.emplace_back(Finish{connection.id, why});
}

void Audience::stop(const std::string& why, Actions& actions) {
  stopping_ = true;
  for (Connection& c : all())
    if (c.state == Connection::State::waiting)
      actions.emplace_back(Reset{c.id, why});
    else
      begin_finish(c, why, actions);
}

void Audience::remove(Connection& connection, const std::string& why, bool by_client, Actions& actions) {
  // Pings that a fault holds back enter the outbox, which then drops them, so that the counters add up.
  for (Connection::Held& held : connection.held) connection.outbox.push_held(std::move(held.ping));
  connection.outbox.end(connection.finishing ? DropReason::stop : DropReason::gone);
  actions.emplace_back(Closed{connection.peer.name, connection.role, connection.state != Connection::State::waiting,
                              connection.pings_written(), connection.outbox.pings_dropped(), why, by_client,
                              connection.is_for_commands()});
  if (connection.role != Role::observer) add_traffic(sonar_.figures, connection);
  connections_.remove(connection.id);
}

// ---- faults

void Audience::end_by_fault(Connection& connection, Faults::RequestVerdict verdict, Actions& actions) {
  if (verdict == Faults::RequestVerdict::reset)
    actions.emplace_back(Reset{connection.id, "a fault"});
  else
    begin_finish(connection, "a fault", actions);
}

void Audience::end_clients(std::optional<ConnectionId> only, bool reset, Actions& actions) {
  using Verdict = Faults::RequestVerdict;
  // Waiting clients end first, because a waiting client may get the slot of a served client at once.
  for (const bool waits : {true, false})
    for (Connection& c : all())
      if (c.role == Role::client && (!only || *only == c.id) && waits == (c.state == Connection::State::waiting))
        end_by_fault(c, reset || waits ? Verdict::reset : Verdict::end, actions);
}

void Audience::read_clients(bool on, Actions& actions) {
  for (const Connection& c : all())
    if (is_client(c)) actions.emplace_back(ReadFrom{c.id, on});
}

void Audience::drop_newest(bool on) {
  for (Connection& c : all())
    if (is_client(c)) c.outbox.use(on ? OutboxRules{1, WhenFull::drop_newest} : sonar_.config.outbox);
}

void Audience::end_pauses(Actions& actions) {
  for (const Connection& c : all())
    if (is_client(c)) actions.emplace_back(EndPauses{c.id});
}

// ---- time

std::optional<Time> Audience::earliest(std::optional<Time> (Connection::*of)() const) const {
  std::optional<Time> first;
  for (const Connection& c : all())
    if (const auto t = (c.*of)(); t && c.role == Role::client && c.state == Connection::State::served && (!first || *t < *first))
      first = t;
  return first ? std::optional(sonar_.clock_time(*first)) : std::nullopt;
}

}  // namespace sonar
