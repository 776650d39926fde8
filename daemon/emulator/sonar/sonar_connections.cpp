// The connections of a Sonar: who gets a slot, what clients request, what they are sent.
#include <algorithm>
#include <cmath>

#include "core/text/ipv4.hpp"
#include "daemon/emulator/sonar/sonar.hpp"

namespace sonar {
namespace {

constexpr std::size_t most_receivers = 16;  // limit for one list

/// The next receiver of a stream is not sent pings that were made for the last one.
void drop_unreceived(Connections& connections) {
  for (Connection& c : connections.all())
    if (c.role == Role::stream && connections.receivers(c).empty()) c.outbox.drop_waiting_pings(DropReason::gone);
}

}  // namespace

Actions Sonar::on_connect(ConnectionId id, Role role, Peer peer, Time now, const protocol::Port* port) {
  Actions actions;
  if (port == nullptr) port = vendor_.port(protocol::Port::Kind::tcp_stream);
  // The slots decide; a fault of clients may replace their decision; a sonar that stops refuses all clients.
  Connections::Verdict verdict = stopping_ ? Connections::Verdict::refuse : connections_.verdict(role);
  const auto admission = role == Role::client && !stopping_ ? faults_.admission() : Faults::Admission::as_configured;
  if (admission == Faults::Admission::wait) verdict = Connections::Verdict::wait;
  if (admission == Faults::Admission::take_over && verdict != Connections::Verdict::serve && connections_.clients() > 0)
    verdict = Connections::Verdict::take_over;
  if (admission == Faults::Admission::refuse || admission == Faults::Admission::reset) verdict = Connections::Verdict::refuse;
  if (verdict == Connections::Verdict::refuse) {
    if (role == Role::client) ++figures_.refused_clients;
    actions.emplace_back(Refuse{id, admission == Faults::Admission::reset});
    return actions;
  }
  if (verdict == Connections::Verdict::wait) {
    connections_.add(id, role, std::move(peer), Connection::State::waiting, port);
    actions.emplace_back(KeepWaiting{id});
    return actions;
  }
  if (verdict == Connections::Verdict::take_over) {
    // The oldest client gets its current message whole, and counts as gone from here on: the new one starts from the stored
    // settings if no other client is left.
    Connection& oldest = *connections_.oldest_client();
    oldest.state = Connection::State::leaving;
    begin_finish(oldest, "another client took over", actions);
    if (!connections_.has_audience()) use_initial_settings();
  }
  serve(connections_.add(id, role, std::move(peer), Connection::State::waiting, port), now, actions);
  return actions;
}

void Sonar::serve(Connection& connection, Time now, Actions& actions) {
  update_depth(now);
  connection.state = Connection::State::served;
  connection.dialogue = vendor_.converse(*connection.port, state_, unskipped(now));
  // Serve makes the session that later actions name, such as the ReadFrom of a fault.
  actions.emplace_back(Serve{connection.id});
  // Observers are not counted, and change neither settings nor the rate of pings.
  if (connection.role == Role::observer) return;
  connection.number = ++figures_.clients;
  on_membership(now, actions);
  faults_.on_served(connection, now);
  apply_fault_orders(now, actions);
}

/// Called after a client has come or gone.
void Sonar::on_membership(Time now, Actions& actions) {
  const Connection* const oldest = connections_.oldest_client();
  state_.connected_client = oldest == nullptr ? protocol::Ipv4{} : oldest->peer.ip;
  if (!connections_.has_audience()) use_initial_settings();
  drop_unreceived(connections_);
  update_pacer(now);
  const protocol::Port* const beacon = vendor_.port(protocol::Port::Kind::udp_beacon);
  if (beacon != nullptr && beacon->on_change) actions.emplace_back(Announce{});
}

/// The pacer runs while pings are wanted, at the requested rate times the factor of faults.
void Sonar::update_pacer(Time now) {
  PingSettings paced = settings_;
  if (const double factor = faults_.rate_factor(); factor != 1) paced.rate_hz *= static_cast<float>(factor);
  if (wants_pings())
    pacer_.configure(paced, now);
  else
    pacer_.stop();
}

// ---- streams of datagrams

Actions Sonar::open_stream(ConnectionId id, const protocol::Port& port, Time now) {
  const auto& all = connections_.all();
  const auto number = std::count_if(all.begin(), all.end(), [](const Connection& c) { return c.role == Role::stream; });
  Connection& stream = connections_.add(id, Role::stream, {}, Connection::State::served, &port);
  stream.receivers.push_back({.to = {}, .stream = static_cast<std::size_t>(number)});
  if (port.group.port != 0) stream.receivers.front().to.push_back(port.group);
  update_pacer(now);
  return {};
}

std::vector<protocol::Endpoint> Sonar::receivers(ConnectionId stream) const {
  const Connection* const connection = connections_.find(stream);
  if (connection == nullptr) return {};
  if (connection->role == Role::client) return {{connection->peer.ip, connection->peer.port}};
  std::vector<protocol::Endpoint> to = connections_.receivers(*connection);
  if (faults_.leaves_group()) std::erase(to, connection->port->group);
  return to;
}

void Sonar::hand_over(ConnectionId id, Peer to) {
  Connection* const host = connections_.find(id);
  if (host == nullptr) return;
  host->peer = std::move(to);
  if (connections_.oldest_client() == host) state_.connected_client = host->peer.ip;
}

void Sonar::set_receivers(const Source& from, protocol::SetReceivers wanted, Time now) {
  Connection* const stream = connections_.stream(wanted.stream);
  if (stream == nullptr) return;
  if (wanted.to.size() > most_receivers) wanted.to.resize(most_receivers);
  for (protocol::Endpoint& to : wanted.to)
    if (to.ip == protocol::Ipv4{}) to.ip = from.ip;
  std::vector<protocol::SetReceivers>& lists = (from.connection == nullptr ? *stream : *from.connection).receivers;
  const auto same = std::find_if(lists.begin(), lists.end(), [&](const auto& list) { return list.stream == wanted.stream; });
  if (same == lists.end())
    lists.push_back(std::move(wanted));
  else
    *same = std::move(wanted);
  drop_unreceived(connections_);
  update_pacer(now);
}

Sonar::Answers Sonar::on_datagram(const protocol::Port& port, const protocol::Endpoint& from, protocol::BytesView datagram,
                                  Time now) {
  Answers answers;
  try {
    protocol::Reaction reaction = vendor_.on_datagram(port, datagram, state_, unskipped(now));
    const std::string name = text::format_ipv4(from.ip) + ":" + std::to_string(from.port);
    for (const protocol::Event& event : reaction.events) on_event({nullptr, name, from.ip}, event, now, answers.actions);
    answers.datagrams = std::move(reaction.replies);
  } catch (const std::exception& e) {
    report_fault(e, answers.actions);
  }
  return answers;
}

Sonar::HttpAnswer Sonar::on_http(const protocol::Port& port, const protocol::ResourceRequest& request, Time now) {
  HttpAnswer answer{{500, "internal fault\n", "text/plain"}, {}};
  try {
    // The time is that of the stamps of pings, because no conversation is open.
    answer.reply = vendor_.on_http(port, request, state_, now);
    const Source from{nullptr, "http " + text::format_ipv4(request.from), request.from};
    for (const protocol::Event& event : answer.reply.events) on_event(from, event, now, answer.actions);
  } catch (const std::exception& e) {
    report_fault(e, answer.actions);
  }
  return answer;
}

// ---- the end of a connection

/// Accounts for the connection before it is removed; then its slot goes to the client that has waited longest.
Actions Sonar::on_closed(ConnectionId id, const std::string& why, Time now, bool by_client) {
  Actions actions;
  Connection* const connection = connections_.find(id);
  if (connection == nullptr) return actions;
  const Role connection_role = connection->role;
  const bool was_client = connection_role == Role::client && connection->state == Connection::State::served;
  // Pings that a fault holds back are offered to the outbox before it drops them, so that the counters add up.
  for (Connection::Held& held : connection->held) connection->outbox.push_ping(std::move(held.ping));
  connection->outbox.end(connection->finishing ? DropReason::stop : DropReason::gone);
  actions.emplace_back(Closed{connection->peer.name, connection->role, connection->state != Connection::State::waiting,
                              connection->pings_written(), connection->outbox.pings_dropped(), why, by_client});
  if (connection->role != Role::observer) add_traffic(figures_, *connection);
  connections_.remove(id);
  if (connection_role == Role::stream) update_pacer(now);
  if (!was_client) return actions;
  faults_.on(Occasion::disconnect, now);
  apply_fault_orders(now, actions);
  const bool kept_waiting = faults_.admission() == Faults::Admission::wait;
  Connection* const next = stopping_ || kept_waiting ? nullptr : connections_.longest_waiting();
  if (next == nullptr) {
    on_membership(now, actions);
    return actions;
  }
  // Before serve(), which calls on_membership(): then the next client counts as audience, and the settings would stay.
  if (!connections_.has_audience()) use_initial_settings();
  serve(*next, now, actions);
  return actions;
}

/// Waiting pings are dropped; the message that is being written and replies are still sent.
void Sonar::finish(ConnectionId id) {
  Connection* const connection = connections_.find(id);
  if (connection == nullptr || std::exchange(connection->finishing, true)) return;
  connection->outbox.drop_waiting_pings(DropReason::stop);
}

void Sonar::begin_finish(Connection& connection, const std::string& why, Actions& actions) {
  if (connection.finishing) return;
  finish(connection.id);
  actions.emplace_back(Finish{connection.id, why});
}

Actions Sonar::stop(const std::string& why) {
  Actions actions;
  stopping_ = true;
  pacer_.stop();
  for (Connection& c : connections_.all())
    if (c.state == Connection::State::waiting)
      actions.emplace_back(Reset{c.id, why});
    else
      begin_finish(c, why, actions);
  return actions;
}

Actions Sonar::on_bytes(ConnectionId id, protocol::BytesView bytes, Time now) {
  Actions actions;
  Connection* const from = connections_.find(id);
  if (from == nullptr || from->dialogue == nullptr) return actions;
  from->bytes_read += bytes.size();
  // The bytes may make the dialogue's next tick due at once.
  from->not_before = {};
  if (from->finishing) return actions;
  if (const auto verdict = faults_.on_bytes(from->peer.name, now);
      verdict != Faults::RequestVerdict::apply && from->role == Role::client) {
    end_by_fault(*from, verdict, actions);
    return actions;
  }
  guarded(*from, actions, [&] { handle(*from, from->dialogue->on_bytes(bytes, unskipped(now)), now, actions); });
  return actions;
}

/// Events come before replies, and a Close after both, so that a client that is closed still gets the replies.
void Sonar::handle(Connection& from, protocol::Reaction reaction, Time now, Actions& actions) {
  std::string close_why;
  for (const protocol::Event& event : reaction.events) {
    if (const auto* close = std::get_if<protocol::Close>(&event))
      close_why = close->why;
    else
      on_event(source_of(from), event, now, actions);
  }
  for (protocol::Bytes& reply : reaction.replies)
    if (!from.outbox.push_reply(std::move(reply))) {
      actions.emplace_back(Reset{from.id, "asks faster than it reads the answers"});
      return;
    }
  if (!close_why.empty()) return begin_finish(from, close_why, actions);
  if (!reaction.replies.empty()) actions.emplace_back(Wake{from.id});
}

void Sonar::on_event(const Source& from, const protocol::Event& event, Time now, Actions& actions) {
  if (stopping_) return;
  const bool observer = from.connection != nullptr && from.connection->role == Role::observer;
  const auto* const notice = std::get_if<protocol::Notice>(&event);
  if (from.connection != nullptr && notice != nullptr) from.connection->complaint = notice->text;
  const bool asks =
      std::holds_alternative<protocol::ChangeSettings>(event) || std::holds_alternative<protocol::RequestPing>(event);
  if (from.connection != nullptr && asks) ++from.connection->requests;
  if (notice != nullptr) {
    if (!observer) report(Report::Topic::notice, LogLevel::warning, notice->text, {{"client", from.name}}, actions);
  } else if (observer) {
    // Settings, triggers and addresses are for clients. An observer that sends them may have meant the other port.
    report(Report::Topic::ignored, LogLevel::info, "request of an observer ignored: only clients change what a sonar does",
           {{"observer", from.name}}, actions);
  } else if (const auto* change = std::get_if<protocol::ChangeSettings>(&event)) {
    change_as_requested(from, *change, now, actions);
  } else if (const auto* request = std::get_if<protocol::RequestPing>(&event)) {
    // The ping being computed is used only if it was fired with the present settings.
    const bool served = request->joins && busy_ && busy_settings_ == state_.settings;
    if (served) return;
    aim_ = *request;
    pacer_.trigger(now, request->joins);
  } else if (const auto* store = std::get_if<protocol::StoreAddress>(&event)) {
    state_.stored_address = store->address;
  } else if (const auto* receivers = std::get_if<protocol::SetReceivers>(&event)) {
    set_receivers(from, *receivers, now);
  }
}

void Sonar::on_not_sent(ConnectionId id) {
  if (Connection* const to = connections_.find(id)) to->outbox.not_written();
}

/// The next message to write; those that a fault withholds are counted as dropped on the way.
Outbox::Message Sonar::next_message(ConnectionId id, Time now) {
  Connection* const to = connections_.find(id);
  if (to == nullptr) return {};
  while (Outbox::Message message = to->outbox.take()) {
    if (faults_.shape(*to, message, now)) return message;
    to->outbox.not_written(DropReason::fault);
  }
  return {};
}

void Sonar::on_sent(ConnectionId id, std::size_t bytes) {
  if (Connection* const to = connections_.find(id)) to->bytes_written += bytes;
}

void Sonar::on_written(ConnectionId id, const Outbox::Message& message, Time now) {
  Connection* const to = connections_.find(id);
  if (to == nullptr) return;
  to->outbox.written();
  if (to->role == Role::observer || message.ping == 0) return;
  // The datagrams of a stream count for each client that receives them.
  for (Connection& c : connections_.all()) {
    if (to->role != Role::stream || c.role != Role::client || !c.receives(to->receivers.front().stream)) continue;
    ++c.streamed_pings;
    c.streamed_bytes += message.size();
  }
  figures_.latency.add(seconds(now - message.fired_at));
  if (message.ping <= last_served_.ping) return;  // jitter counts a ping once, at its first client
  if (last_served_.ping != 0)
    figures_.jitter.add(std::abs(seconds(now - last_served_.at) - seconds(message.fired_at - last_served_.tick)));
  last_served_ = {message.ping, message.fired_at, now};
  ++figures_.served;
}

}  // namespace sonar
