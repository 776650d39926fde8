#include "daemon/emulator/sonar/delivery.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace sonar {
namespace {

std::size_t held_bytes(const Connection& c) {
  return std::accumulate(c.held.begin(), c.held.end(), std::size_t{0},
                         [](std::size_t sum, const Connection::Held& held) { return sum + held.ping.size(); });
}

/// Makes a pause before each part except the first.
std::shared_ptr<const Outbox::Shape> pauses_between(const std::vector<protocol::Bytes>& parts, std::chrono::nanoseconds gap) {
  Outbox::Shape shape;
  std::size_t end = 0;
  for (const protocol::Bytes& part : parts) {
    if (end > 0) shape.pauses.push_back({end, gap});
    end += part.size();
  }
  return shape.pauses.empty() ? nullptr : std::make_shared<const Outbox::Shape>(std::move(shape));
}

}  // namespace

// ---- a ping as bytes

FramedPing::FramedPing(const protocol::Vendor& vendor, const protocol::DeviceState& state, const Ping& ping,
                       const PartsByPort* recorded)
    : vendor_(vendor), state_(state), ping_(ping), recorded_(recorded) {
  if (recorded_ == nullptr) {
    bytes_ = vendor.frame(ping, state);
    is_first_ports_ = bytes_ != nullptr;
  } else if ((recorded_->size() == 1 || !vendor.has_several_streams()) && !recorded_->empty() &&
             vendor.pings_by() != protocol::PingsBy::datagrams) {
    auto all = std::make_shared<Bytes>();
    for (const auto& [port, bytes] : *recorded_) all->insert(all->end(), bytes.begin(), bytes.end());
    bytes_ = std::move(all);
  }
  if (bytes_ != nullptr || !vendor.has_several_streams()) return;
  // The bytes of the ping are joined from the parts of the ports, so that the ping is encoded only once.
  auto whole = std::make_shared<Bytes>();
  for (const protocol::Port& port : vendor.ports())
    if (port.kind == protocol::Port::Kind::tcp_stream)
      for (const Bytes& part : *parts(port)) whole->insert(whole->end(), part.begin(), part.end());
  if (recorded_ == nullptr || !whole->empty()) bytes_ = std::move(whole);
}

FramedPing::AtPort& FramedPing::at(const protocol::Port& port) {
  for (AtPort& made : ports_)
    if (made.port == &port) return made;
  auto parts = std::make_shared<const std::vector<Bytes>>(made_for(port));
  auto pauses = port.kind == protocol::Port::Kind::tcp_stream ? pauses_between(*parts, port.gap) : nullptr;
  return ports_.emplace_back(AtPort{&port, std::move(parts), std::move(pauses)});
}

std::vector<FramedPing::Bytes> FramedPing::made_for(const protocol::Port& port) const {
  if (recorded_ == nullptr) return vendor_.datagrams(port, ping_, state_);
  std::vector<Bytes> made;
  for (const auto& [number, bytes] : *recorded_)
    if (number == 0 || number == port.number) made.push_back(bytes);
  return made;
}

std::shared_ptr<const FramedPing::Bytes> FramedPing::bytes_at(const protocol::Port& port) {
  if (!vendor_.has_several_streams() || (is_first_ports_ && &port == vendor_.port(protocol::Port::Kind::tcp_stream)))
    return bytes_;
  const Datagrams& own = parts(port);
  return own->empty() ? nullptr : std::shared_ptr<const Bytes>(own, &own->front());
}

const FramedPing::Datagrams& FramedPing::parts(const protocol::Port& port) { return at(port).parts; }

std::shared_ptr<const Outbox::Shape> FramedPing::pauses(const protocol::Port& port) {
  return port.gap.count() == 0 ? nullptr : at(port).pauses;
}

// ---- a ping is offered

PingQueued Delivery::queue(const PingOutcome& outcome, Time now, Requests& requests, Actions& actions) {
  // This call decides which faults act on the ping; the calls below use the decisions.
  faults_.begin_ping(static_cast<std::uint32_t>(outcome.ping->request.number), now);
  const auto reported = faults_.altered(outcome.ping, sonar_.state, now);
  FramedPing framed(sonar_.vendor, sonar_.state, *reported, outcome.recorded.get());
  PingQueued queued{outcome.ping, framed.bytes(), {}, outcome.seconds};
  if (outcome.recorded == nullptr && !faults_.withholds(static_cast<std::uint32_t>(outcome.ping->request.number), now))
    queued.distance = sonar_.vendor.distance_in(*reported);
  for (Connection& c : audience_.all())
    audience_.guarded(c, actions, [&] {
      for (protocol::Event& event : offer(c, framed, queued, now, actions)) requests.emplace_back(&c, std::move(event));
    });
  sonar_.state.framed_at = reported->request.fired_at;
  return queued;
}

/// Offers a ping to a client. Returns the requests that the client makes next.
std::vector<protocol::Event> Delivery::offer(Connection& to, FramedPing& framed, PingQueued& queued, Time now, Actions& actions) {
  const bool by_datagrams = to.takes_datagrams();
  if (to.finishing || to.state != Connection::State::served || (!by_datagrams && framed.bytes() == nullptr)) return {};
  const auto bytes = by_datagrams ? nullptr : to.role == Role::observer ? framed.bytes() : framed.bytes_at(*to.port);
  if (to.role == Role::stream && receivers(to.id).empty()) return {};
  const PingRequest& request = queued.ping->request;
  // A stream has no dialogue, so its receivers get every ping, without a prefix.
  protocol::Delivery wanted{{protocol::Bytes{}}, {}};
  if (to.dialogue != nullptr)
    wanted = to.dialogue->on_ping(request.vendor_settings.get(), bytes == nullptr ? 0 : bytes->size(), sonar_.unskipped(now));
  // An observer requests nothing, but gets the pings that clients request.
  if (to.role == Role::observer && wanted.prefixes.empty() && bytes != nullptr && !bytes->empty()) wanted.prefixes.emplace_back();
  if (!wanted.prefixes.empty()) {
    Outbox::Message message{
        .bytes = nullptr, .ping = static_cast<std::uint32_t>(request.number), .prefixes = {}, .fired_at = request.fired_at};
    if (by_datagrams) {
      message.datagrams = datagrams_for(to, framed, message.ping, now);
      if (message.datagrams != nullptr) queued.datagrams.push_back(message.datagrams);
    } else {
      message.bytes = bytes;
      if (wanted.prefixes.size() == 1 && wanted.prefixes.front().empty())
        message.shape = framed.pauses(*to.port);
      else
        message.prefixes = std::move(wanted.prefixes);
    }
    if (message) deliver(to, std::move(message), now, actions);
  }
  if (to.role == Role::observer) return {};
  return std::move(wanted.events);
}

/// Returns the datagrams for a stream; null if there are none to send. If faults removed all, the ping is counted as dropped.
FramedPing::Datagrams Delivery::datagrams_for(Connection& to, FramedPing& framed, std::uint32_t ping, Time now) {
  const FramedPing::Datagrams& made = framed.parts(*to.port);
  if (made->empty()) return nullptr;
  if (!faults_.alters_datagrams(to, ping)) return made;
  std::vector<protocol::Bytes> altered = *made;
  faults_.alter_datagrams(altered, to, ping, now);
  if (altered.empty()) return to.outbox.drop_offered(DropReason::fault), nullptr;
  return std::make_shared<const std::vector<protocol::Bytes>>(std::move(altered));
}

// ---- pings held back

void Delivery::deliver(Connection& to, Outbox::Message ping, Time now, Actions& actions) {
  using Kind = Faults::Hold::Kind;
  const Faults::Hold hold = to.role == Role::client ? faults_.hold(to, ping.ping, now) : Faults::Hold{};
  std::deque<Connection::Held>& held = to.held;
  // A ping that no fault holds back is sent at once, before a ping that was held to be swapped with it.
  if (hold.kind == Kind::pass && (held.empty() || held.front().after_next)) {
    to.outbox.push_ping(std::move(ping));
    actions.emplace_back(Wake{to.id});
    if (!held.empty()) release_held(to, now, true, actions);
    return;
  }
  if (held.size() >= Outbox::most_held || held_bytes(to) + ping.size() > Outbox::most_held_bytes)
    return to.outbox.drop_offered(DropReason::fault);
  // A ping that waits for an event (collect, after_next) has no release time (Time::max()). Pings keep their order.
  const Time earliest = held.empty() ? now : held.back().until;
  const Time until = hold.kind == Kind::until ? std::max(hold.until, earliest) : hold.kind == Kind::pass ? earliest : Time::max();
  held.push_back({std::move(ping), until, hold.kind == Kind::after_next});
  if (hold.kind == Kind::collect && held.size() >= hold.collect) release_held(to, now, true, actions);
}

void Delivery::release_held(Connection& to, Time now, bool all, Actions& actions) {
  if (to.held.empty() || (!all && to.held.front().until > now)) return;
  while (!to.held.empty() && (all || to.held.front().until <= now)) {
    to.outbox.push_held(std::move(to.held.front().ping));
    to.held.pop_front();
  }
  actions.emplace_back(Wake{to.id});
}

void Delivery::release_held(Time now, bool all, Actions& actions) {
  for (Connection& c : audience_.all()) release_held(c, now, all, actions);
}

std::optional<Time> Delivery::next_release() const {
  std::optional<Time> first;
  for (const Connection& c : audience_.all())
    if (!c.held.empty() && (!first || c.held.front().until < *first)) first = c.held.front().until;
  return first;
}

// ---- messages for the caller

std::vector<protocol::Endpoint> Delivery::receivers(ConnectionId stream) const {
  const Connection* const connection = std::as_const(audience_).connections().find(stream);
  if (connection == nullptr) return {};
  if (connection->role == Role::client) return {{connection->peer.ip, connection->peer.port}};
  std::vector<protocol::Endpoint> to = audience_.connections().receivers(*connection);
  if (faults_.leaves_group()) std::erase(to, connection->port->group);
  return to;
}

/// Skips messages that a fault withholds, and counts them as dropped.
Outbox::Message Delivery::next_message(ConnectionId id, Time now) {
  Connection* const to = audience_.connections().find(id);
  if (to == nullptr) return {};
  while (Outbox::Message message = to->outbox.take()) {
    if (faults_.shape(*to, message, now)) return message;
    to->outbox.not_written(DropReason::fault);
  }
  return {};
}

void Delivery::on_sent(ConnectionId id, std::size_t bytes) {
  if (Connection* const to = audience_.connections().find(id)) to->bytes_written += bytes;
}

void Delivery::on_not_sent(ConnectionId id) {
  if (Connection* const to = audience_.connections().find(id)) to->outbox.not_written();
}

void Delivery::on_written(ConnectionId id, const Outbox::Message& message, Time now) {
  Connection* const to = audience_.connections().find(id);
  if (to == nullptr) return;
  to->outbox.written();
  if (to->role == Role::observer || message.ping == 0) return;
  // Datagrams of a stream count for each client that receives them.
  for (Connection& c : audience_.all()) {
    if (to->role != Role::stream || c.role != Role::client || !c.receives(to->receivers.front().stream)) continue;
    ++c.streamed_pings;
    c.streamed_bytes += message.size();
  }
  DeviceFigures& figures = sonar_.figures;
  figures.latency.add(seconds(now - message.fired_at));
  if (message.ping <= last_served_.ping) return;  // only the first client of a ping counts for jitter
  if (last_served_.ping != 0)
    figures.jitter.add(std::abs(seconds(now - last_served_.at) - seconds(message.fired_at - last_served_.tick)));
  last_served_ = {message.ping, message.fired_at, now};
  ++figures.served;
}

// ---- status messages

std::vector<protocol::Bytes> Delivery::beacons(Time now) {
  sonar_.update_depth(now);
  std::vector<protocol::Bytes> datagrams;
  if (protocol::Bytes status = sonar_.vendor.beacon(sonar_.state, now); !status.empty()) datagrams.push_back(std::move(status));
  faults_.alter_beacons(datagrams, now);
  return datagrams;
}

}  // namespace sonar
