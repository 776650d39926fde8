#include "daemon/emulator/sonar/sonar.hpp"

#include <algorithm>

#include "core/base/overloaded.hpp"
#include "core/text/ipv4.hpp"

namespace sonar {
namespace {

constexpr auto shortest_rhythm = std::chrono::milliseconds(1);  // shortest time between two ticks of one dialogue

std::optional<Time> earlier(std::optional<Time> a, std::optional<Time> b) { return a && b ? std::min(*a, *b) : a ? a : b; }

}  // namespace

Sonar::Sonar(Surroundings around, SonarConfig config, std::uint32_t index, Time now, std::chrono::nanoseconds skipped)
    : data_(around, std::move(config), index, now, skipped),
      audience_(data_),
      faults_({data_.vendor, audience_.connections(), data_.config.name, index, Seed(around.config.seed), around.journal}, now),
      source_(data_, audience_, faults_),
      delivery_(data_, audience_, faults_) {}

// ---- control

Result<Actions> Sonar::change(const protocol::SettingsOverride& wanted, const std::string& who, Time now) {
  const auto change = vendor().apply_override(wanted, state());
  if (!change) return tl::make_unexpected(change.error());
  Actions actions;
  source_.change_settings(*change, who, now, actions);
  return actions;
}

void Sonar::move_mount(const Pose& mount, Time now) {
  data_.config.mount = mount;
  data_.update_depth(now);
}

void Sonar::move(const SonarConfig& config, Time now) {
  data_.config.vehicle = config.vehicle;
  move_mount(config.mount, now);
}

/// Returns the figures of ended connections, which `data_` has, plus those of the present connections.
DeviceFigures Sonar::figures() const {
  DeviceFigures f = data_.figures;
  f.ticks = source_.pacer().ticks();
  f.skipped = source_.pacer().skipped();
  f.skipped_ticks = f.skipped.total() + f.skipped_stale;
  f.clients_now = connections().clients();
  f.clients_queued = connections().waiting();
  for (const Connection& c : connections().all())
    if (c.role != Role::observer) add_traffic(f, c);
  return f;
}

// ---- time

std::optional<Time> Sonar::next_conversation() const {
  return earlier(source_.next_unsent(), audience_.earliest(&Connection::next_tick));
}

/// Returns nullopt while poses are stale and the rule for stale poses forbids pings, so that stepped time does not wait for a
/// request.
std::optional<Time> Sonar::next_request() const {
  const auto next = audience_.earliest(&Connection::next_request);
  return next && source_.waits_for_pose(*next) ? std::nullopt : next;
}

std::optional<Time> Sonar::next_tick() const { return earlier(source_.pacer().next_tick(), next_tick_of_conversations()); }

std::optional<Time> Sonar::next_tick_of_conversations() const {
  std::optional<Time> first = earlier(source_.next_unsent(), earlier(faults_.next_tick(), delivery_.next_release()));
  for (const Connection& c : connections().all())
    if (const auto t = c.next_tick()) first = earlier(first, data_.clock_time(*t));
  return first;
}

Actions Sonar::on_tick(Time now) {
  // Dialogues are called first, so that a ping that a dialogue requests now is fired in the same tick.
  Actions actions = tick_conversations(now);
  for (Action& action : source_.tick(now)) actions.push_back(std::move(action));
  return actions;
}

Actions Sonar::tick_conversations(Time now) {
  Actions actions;
  const Time at = data_.unskipped(now);
  for (Connection& c : audience_.all()) {
    if (c.finishing || c.dialogue == nullptr || at < c.dialogue->next_tick()) continue;
    audience_.guarded(c, actions, [&] { handle(c, c.dialogue->on_tick(at, source_.pacer().trigger_waits()), now, actions); });
    c.not_before = at + shortest_rhythm;
  }
  while (const auto unsent = source_.take_unsent(now)) deliver(*unsent, now, actions);
  faults_.on_tick(now);
  delivery_.release_held(now, false, actions);
  apply_fault_orders(now, actions);
  return actions;
}

// Dialogues use unskipped time, so a jump makes no keep-alive due.
void Sonar::skip(std::chrono::nanoseconds by) {
  data_.state.skipped += by;
  source_.skip(by);
  // Stamps that count from power-up must not include the jump.
  data_.state.powered_up_at += by;
}

// ---- pings

Actions Sonar::on_ping(PingOutcome outcome, Time now) {
  Actions actions;
  if (source_.on_ping(outcome, now, actions) && !source_.keep_unsent(outcome, now)) deliver(outcome, now, actions);
  source_.catch_up(actions);
  return actions;
}

void Sonar::deliver(const PingOutcome& outcome, Time now, Actions& actions) {
  Delivery::Requests requests;
  PingQueued queued = delivery_.queue(outcome, now, requests, actions);
  // Requests that follow this ping take effect after all clients were offered the ping, because they may change the settings.
  for (const auto& [from, event] : requests) on_event(source_of(*from), event, now, actions);
  actions.emplace_back(std::move(queued));
  apply_fault_orders(now, actions);
  if (pings() == 1)
    data_.report(Report::Topic::state, LogLevel::debug, "first ping simulated", {{"ms", outcome.seconds * 1e3}}, actions);
}

// ---- connections

Actions Sonar::on_connect(ConnectionId id, Role role, Peer peer, Time now, const protocol::Port* port) {
  Actions actions;
  const bool had_audience = audience_.has_audience(), ran_itself = source_.runs_itself();
  Connection* const admitted = audience_.admit(id, role, std::move(peer), port, faults_.admission(), actions);
  if (admitted == nullptr) return actions;
  // The first client, and a client after a take-over without other clients, begin with the initial settings.
  if (had_audience ? !audience_.has_audience() : ran_itself && role == Role::client) source_.forget_clients();
  serve(*admitted, now, actions);
  return actions;
}

void Sonar::serve(Connection& connection, Time now, Actions& actions) {
  data_.update_depth(now);
  audience_.serve(connection, now, actions);
  // Observers change neither settings nor the rate of pings.
  if (connection.role == Role::observer) return;
  on_membership(now, actions);
  faults_.on_served(connection, now);
  apply_fault_orders(now, actions);
}

void Sonar::serve_waiting(Time now, Actions& actions) {
  while (connections().clients() < static_cast<std::size_t>(config().max_clients)) {
    Connection* const next = audience_.next_waiting();
    if (next == nullptr) return;
    serve(*next, now, actions);
  }
}

/// Called after a client has connected or left.
void Sonar::on_membership(Time now, Actions& actions) {
  if (!audience_.has_audience()) source_.forget_clients();
  audience_.on_membership();
  source_.update_pacer(now);
  const protocol::Port* const beacon = vendor().port(protocol::Port::Kind::udp_beacon);
  if (beacon != nullptr && beacon->on_change) actions.emplace_back(Announce{});
}

Actions Sonar::open_stream(ConnectionId id, const protocol::Port& port, Time now) {
  audience_.open_stream(id, port);
  source_.update_pacer(now);
  return {};
}

/// Counts the connection's traffic, then removes the connection.
Actions Sonar::on_closed(ConnectionId id, const std::string& why, Time now, bool by_client) {
  Actions actions;
  Connection* const connection = audience_.connections().find(id);
  if (connection == nullptr) return actions;
  const Role role = connection->role;
  const bool was_client = role == Role::client && connection->state == Connection::State::served;
  audience_.remove(*connection, why, by_client, actions);
  if (role == Role::stream) source_.update_pacer(now);
  if (was_client) on_left(now, actions);
  return actions;
}

Actions Sonar::finish(ConnectionId id, Time now) {
  Actions actions;
  Connection* const connection = audience_.connections().find(id);
  if (connection == nullptr) return actions;
  audience_.finish(*connection);
  if (connection->role != Role::client || connection->state != Connection::State::served || !connection->takes_datagrams())
    return actions;
  connection->state = Connection::State::leaving;
  on_left(now, actions);
  return actions;
}

/// Called after a client has left: assigns its slot to the client that has waited longest.
void Sonar::on_left(Time now, Actions& actions) {
  faults_.on(Occasion::disconnect, now);
  apply_fault_orders(now, actions);
  const bool kept_waiting = faults_.admission() == Faults::Admission::wait;
  Connection* const next = kept_waiting ? nullptr : audience_.next_waiting();
  if (next == nullptr) return on_membership(now, actions);
  // This must be before serve(), after which the next client counts as audience, so that the settings would not be restored.
  if (!audience_.has_audience()) source_.forget_clients();
  serve(*next, now, actions);
}

// Clients still get the rest of the current message; connections that wait for a slot are reset.
Actions Sonar::stop(const std::string& why) {
  Actions actions;
  source_.stop();
  audience_.stop(why, actions);
  return actions;
}

// ---- input from hosts

Actions Sonar::on_bytes(ConnectionId id, protocol::BytesView bytes, Time now) {
  Actions actions;
  Connection* const from = audience_.connections().find(id);
  if (from == nullptr || from->dialogue == nullptr) return actions;
  from->bytes_read += bytes.size();
  // After the bytes, the next tick of the dialogue may be due at once.
  from->not_before = {};
  if (from->finishing) return actions;
  if (const auto verdict = faults_.on_bytes(from->peer.name, now);
      verdict != Faults::RequestVerdict::apply && from->role == Role::client) {
    audience_.end_by_fault(*from, verdict, actions);
    return actions;
  }
  audience_.guarded(*from, actions, [&] {
    protocol::Reaction reaction = from->dialogue->on_bytes(bytes, data_.unskipped(now));
    reactions_ += reaction.events.size() + reaction.replies.size();
    handle(*from, std::move(reaction), now, actions);
  });
  return actions;
}

Sonar::Answers Sonar::on_datagram(const protocol::Port& port, const protocol::Endpoint& from, protocol::BytesView datagram,
                                  Time now) {
  Answers answers;
  try {
    protocol::Reaction reaction = vendor().on_datagram(port, datagram, state(), data_.unskipped(now));
    const std::string name = text::format_ipv4(from.ip) + ":" + std::to_string(from.port);
    for (const protocol::Event& event : reaction.events) on_event({nullptr, name, from.ip}, event, now, answers.actions);
    answers.datagrams = std::move(reaction.replies);
  } catch (const std::exception& e) {
    data_.report_fault(e, answers.actions);
  }
  return answers;
}

Sonar::HttpAnswer Sonar::on_http(const protocol::Port& port, const protocol::ResourceRequest& request, Time now) {
  HttpAnswer answer{{500, "internal fault\n", "text/plain"}, {}};
  try {
    // Here the time includes jumps, like the stamps of pings, because no dialogue is involved.
    answer.reply = vendor().on_http(port, request, state(), now);
    const Source from{nullptr, "http " + text::format_ipv4(request.from), request.from};
    for (const protocol::Event& event : answer.reply.events) on_event(from, event, now, answer.actions);
  } catch (const std::exception& e) {
    data_.report_fault(e, answer.actions);
  }
  return answer;
}

/// Handles events, then replies, then Close, so that a client that is closed still gets the replies.
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
      actions.emplace_back(Reset{from.id, "sends requests faster than it reads the answers"});
      return;
    }
  if (!close_why.empty()) return audience_.begin_finish(from, close_why, actions);
  if (!reaction.replies.empty()) actions.emplace_back(Wake{from.id});
}

void Sonar::on_event(const Source& from, const protocol::Event& event, Time now, Actions& actions) {
  if (audience_.stopping()) return;
  const bool observer = from.connection != nullptr && from.connection->role == Role::observer;
  const auto* const notice = std::get_if<protocol::Notice>(&event);
  if (from.connection != nullptr && notice != nullptr) from.connection->complaint = notice->text;
  const bool asks =
      std::holds_alternative<protocol::ChangeSettings>(event) || std::holds_alternative<protocol::RequestPing>(event);
  if (from.connection != nullptr && asks) ++from.connection->requests;
  if (notice != nullptr) {
    if (!observer) data_.report(Report::Topic::notice, LogLevel::warning, notice->text, {{"client", from.name}}, actions);
  } else if (observer) {
    // Only clients may send settings, triggers and addresses. An observer that sends one probably uses the wrong port.
    data_.report(Report::Topic::ignored, LogLevel::info, "request of an observer ignored: only clients can change settings",
                 {{"observer", from.name}}, actions);
  } else if (const auto* change = std::get_if<protocol::ChangeSettings>(&event)) {
    change_as_requested(from, *change, now, actions);
  } else if (const auto* request = std::get_if<protocol::RequestPing>(&event)) {
    source_.trigger(*request, now);
  } else if (const auto* store = std::get_if<protocol::StoreAddress>(&event)) {
    data_.state.stored_address = store->address;
  } else if (const auto* receivers = std::get_if<protocol::SetReceivers>(&event)) {
    audience_.set_receivers(from.connection, from.ip, *receivers);
    source_.update_pacer(now);
  }
}

/// Applies requested settings, unless a fault ignores or delays the request or ends the connection.
void Sonar::change_as_requested(const Source& from, protocol::ChangeSettings change, Time now, Actions& actions) {
  const Faults::RequestVerdict verdict = faults_.on_request(change, from.name, state(), now);
  apply_fault_orders(now, actions);
  if (verdict == Faults::RequestVerdict::apply) return source_.change_settings(change, from.name, now, actions);
  if (from.connection != nullptr && verdict != Faults::RequestVerdict::ignore)
    audience_.end_by_fault(*from.connection, verdict, actions);
}

// ---- faults

Actions Sonar::add_faults(const std::vector<Fault>& faults, bool manual, Time now) {
  Actions actions;
  faults_.add(faults, manual, now, actions);
  apply_fault_orders(now, actions);
  return actions;
}

bool Sonar::end_faults(const std::string& name, Time now, Actions& actions) {
  const bool found = faults_.end(name, now, actions);
  apply_fault_orders(now, actions);
  return found;
}

/// Carries out the orders of faults for ports, clients and settings. Called after each call that may cause orders.
void Sonar::apply_fault_orders(Time now, Actions& actions) {
  for (const FaultOrder& order : faults_.take_orders()) apply(order, now, actions);
}

void Sonar::apply(const FaultOrder& order, Time now, Actions& actions) {
  std::visit(Overloaded{[&](const SetListening& listening) { actions.emplace_back(Listen{listening.on}); },
                        [&](const EndClients& end) { audience_.end_clients(end.only, end.reset, actions); },
                        [&](const ForgetSettings&) { source_.forget_settings(now); },
                        [&](const RestartDevice& restart) {
                          source_.restart(restart.clock_only, now);
                          if (!restart.clock_only) delivery_.restart();
                        },
                        [&](const OverrideSettings& wanted) { source_.override_settings(wanted.wanted, now, actions); },
                        [&](const ApplyRequest& late) { source_.change_settings(late.change, late.who, now, actions); },
                        [&](const ChangePace&) { source_.update_pacer(now); },
                        [&](const ReadClients& reads) { audience_.read_clients(reads.on, actions); },
                        [&](const DropNewestPings& drops) { audience_.drop_newest(drops.on); },
                        [&](const ReleaseHeld&) { delivery_.release_held(now, true, actions); },
                        [&](const StopShaping&) { audience_.end_pauses(actions); },
                        [&](const ServeWaiting&) { serve_waiting(now, actions); }},
             order);
}

}  // namespace sonar
