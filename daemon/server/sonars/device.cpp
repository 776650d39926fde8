#include "daemon/server/sonars/device.hpp"

#include <algorithm>
#include <array>

#include "daemon/server/system/listen.hpp"

namespace sonar {
namespace {

constexpr int most_turned_away_at_once = 16;

}  // namespace

Device::Device(DeviceContext& context, const SonarConfig& config, std::uint32_t index)
    : context_(context),
      sonar_({context.config, context.world}, config, index, context.clock.now(), context.clock.skipped()),
      acceptor_(context.io),
      observer_acceptor_(context.io),
      beacon_(context.io),
      beacon_timer_(context.io),
      timer_(context.io),
      answers_(context.io, [this](protocol::BytesView datagram) { return sonar_.on_datagram(datagram); }),
      visits_(context.io, context.log, config.name) {}

Device::~Device() = default;

// ---- ports

Result<void> Device::open() {
  const SonarConfig& config = sonar_.config();
  for (const protocol::Port& port : sonar_.vendor().ports()) {
    if (port.kind == protocol::Port::Kind::tcp_listen) {
      if (auto r = listen_tcp(acceptor_, {config.bind_ip, port.number}); !r) return r;
    } else if (port.kind == protocol::Port::Kind::udp_answer) {
      if (auto r = answers_.open(config, port.number); !r) return r;
    } else {
      beacon_period_ = port.period;
      for (const Endpoint& to : config.status_to)
        status_to_.emplace_back(address_of(to.ip), to.port == 0 ? port.number : to.port);
      // An ephemeral port, but never by chance the one that drivers listen on.
      for (int attempt = 0; attempt < 8; ++attempt) {
        if (beacon_.is_open()) beacon_.close();
        if (auto r = bind_udp(beacon_, {config.bind_ip, 0}, true); !r) return r;
        if (beacon_.local_endpoint().port() != port.number) break;
      }
    }
  }
  return open_observers();
}

Result<void> Device::open_observers() {
  const SonarConfig& config = sonar_.config();
  if (config.max_observers == 0) return {};
  const Endpoint at{config.bind_ip, config.observer_port};
  if (auto r = listen_tcp(observer_acceptor_, at); !r)
    return failure(r.error().kind, r.error().text + "; observers: {port: 0} in the configuration takes any that is free");
  observers_at_ = {at.ip, observer_acceptor_.local_endpoint().port()};
  return {};
}

tcp::endpoint Device::data_endpoint() const {
  error_code ec;
  return acceptor_.local_endpoint(ec);
}

void Device::start() {
  started_ = true;
  keep_accepting(&Device::accept_clients);
  if (observer_acceptor_.is_open()) keep_accepting(&Device::accept_observers);
  answers_.start();
  if (beacon_period_.count() > 0) keep_announcing();
}

void Device::stop(const std::string& why) {
  if (std::exchange(stopping_, true)) return;
  error_code ec;
  acceptor_.close(ec);
  observer_acceptor_.close(ec);
  beacon_timer_.cancel();
  timer_.cancel();
  answers_.stop();
  visits_.end();
  beacon_.close(ec);
  if (started_) context_.recordings.end_of(config().name, why);  // else one of the same name may go on
  perform(sonar_.stop(why));
}

bool Device::gone() const { return sessions_.empty() && turning_away_ == 0 && !sonar_.busy(); }

void Device::report_fault(const std::string& what) { say_fault(context_.log, faults_, what, {"sonar", config().name}); }

void Device::keep_accepting(asio::awaitable<void> (Device::*accept)()) {
  asio::co_spawn(
      context_.io, [this, accept] { return (this->*accept)(); },
      [this, accept](std::exception_ptr fault) {
        if (!fault || stopping_) return;
        report_fault(text_of(fault));
        keep_accepting(accept);
      });
}

asio::awaitable<void> Device::accept_clients() {
  while (auto socket = co_await context_.admission.accept(acceptor_)) {
    if (stopping_) co_return;
    if (auto place = context_.admission.enter(*socket)) {
      on_arrival(*std::move(socket), std::move(place), Role::client);
    } else {
      sonar_.count_refused_client();
      close_politely(*socket);
    }
  }
}

asio::awaitable<void> Device::accept_observers() {
  while (auto socket = co_await context_.admission.next_visitor(observer_acceptor_, Admission::Purpose::client))
    on_arrival(*std::move(socket), {}, Role::observer);
}

void Device::on_arrival(tcp::socket socket, Admission::Place place, Role role) {
  forget_who_left();
  const ConnectionId id = ++last_connection_;
  Peer peer = peer_of(socket);
  arrived_.emplace(id, Arrived{std::move(socket), std::move(place), role});
  perform(sonar_.on_connect(id, role, std::move(peer), context_.clock.now()));
}

/// FIN and no byte. What the client has sent meanwhile is read away, or the kernel would answer it with RST.
asio::awaitable<void> Device::turn_away(tcp::socket socket, Admission::Place place) {
  error_code ec;
  socket.shutdown(tcp::socket::shutdown_send, ec);
  bool late = false;
  asio::steady_timer deadline(context_.io, std::chrono::seconds(1));
  deadline.async_wait([&socket, &late](const error_code& e) {
    if (e) return;
    late = true;  // a read that has just ended is past cancelling, and another would have no end
    socket.cancel();
  });
  std::array<std::byte, 1024> discarded;
  for (int reads = 0; !ec && !late && reads < 64; ++reads) co_await socket.async_read_some(asio::buffer(discarded), into(ec));
  deadline.cancel();
  // The handler above must be done with `socket` before this frame goes.
  co_await asio::post(context_.io, asio::use_awaitable);
  socket.close(ec);  // before its place is free
  place.reset();
}

void Device::forget_who_left() {
  std::vector<ConnectionId> left;
  for (auto& [id, arrived] : arrived_)
    if (has_left(arrived.socket)) left.push_back(id);
  for (const ConnectionId id : left) {
    arrived_.erase(id);
    perform(sonar_.on_closed(id, "it waited for a place", context_.clock.now()));
  }
  for (const SessionPointer& session : std::vector(sessions_.begin(), sessions_.end())) session->end_if_closed();
}

void Device::keep_announcing() {
  asio::co_spawn(
      context_.io, [this] { return announce(); },
      [this](std::exception_ptr fault) {
        if (!fault || stopping_) return;
        report_fault(text_of(fault));
        beacon_timer_.expires_after(beacon_period_);
        beacon_timer_.async_wait([this](const error_code& ec) {
          if (!ec && !stopping_) keep_announcing();
        });
      });
}

asio::awaitable<void> Device::announce() {
  while (!stopping_) {
    const protocol::Bytes status = sonar_.beacon(context_.clock.now());
    for (const udp::endpoint& to : status_to_) {
      error_code ec;
      if (status.empty() || stopping_) break;
      co_await beacon_.async_send_to(asio::buffer(status), to, into(ec));
      if (stopping_) co_return;
      if (ec && !std::exchange(beacon_failed_, true))
        context_.log.warning("cannot send status: " + ec.message(), {{"sonar", config().name}, {"to", to.address().to_string()}});
    }
    error_code ec;
    beacon_timer_.expires_after(beacon_period_);
    co_await beacon_timer_.async_wait(into(ec));
  }
}

// ---- sessions

Device::SessionPointer Device::session_of(ConnectionId id) const {
  const auto it = std::find_if(sessions_.begin(), sessions_.end(), [&](const SessionPointer& s) { return s->id() == id; });
  return it == sessions_.end() ? nullptr : *it;
}

void Device::on_bytes(Session& from, protocol::BytesView bytes) {
  perform(sonar_.on_bytes(from.id(), bytes, context_.clock.now()));
}

void Device::on_written(Session& to, const Outbox::Message& message) {
  sonar_.on_written(to.id(), message, context_.clock.now());
  context_.on_change();
}

std::optional<std::chrono::milliseconds> Device::longest_silence(const Session& of) const {
  const Connection* const connection = sonar_.connections().find(of.id());
  return connection == nullptr ? std::nullopt : connection->dialogue->longest_silence();
}

/// A mistake in sonard, not of a client: it may cost that client its connection, never the others.
void Device::on_fault(Session&, const std::string& what) { report_fault(what); }

void Device::on_over(Session& session, const std::string& why) {
  const Connection* const connection = sonar_.connections().find(session.id());
  if (context_.digest && connection != nullptr && connection->role == Role::client)
    digests_.push_back({connection->number, session.digest().size(), session.digest().hex()});
  const ConnectionId id = session.id();
  sessions_.remove_if([&session](const SessionPointer& s) { return s.get() == &session; });
  forget_who_left();
  perform(sonar_.on_closed(id, why, context_.clock.now()));
}

std::vector<StreamDigest> Device::digests() const {
  auto all = digests_;
  std::sort(all.begin(), all.end(), [](const StreamDigest& a, const StreamDigest& b) { return a.client < b.client; });
  return all;
}

// ---- actions

void Device::perform(Actions actions) {
  for (Action& action : actions) std::visit([this](auto& a) { carry_out(a); }, action);
  arm();
  context_.on_change();
}

void Device::arm() {
  if (stopping_ || context_.clock.stepped()) return;
  const auto next = sonar_.next_tick();
  const auto at = next ? std::optional(context_.clock.timer_at(*next)) : std::nullopt;
  if (at == timer_at_) return;
  timer_at_ = at;
  if (!at) {
    timer_.cancel();
    return;
  }
  timer_.expires_at(*at);
  timer_.async_wait([this](const error_code& ec) {
    if (ec || stopping_) return;
    timer_at_.reset();
    perform(sonar_.on_tick(context_.clock.now()));
  });
}

void Device::carry_out(ComputePing& action) {
  action.request.switches.keep_truth = context_.recordings.wants_truth(config().name);
  computed_names_ = context_.recordings.names();
  context_.simulator.submit(std::move(action.request), [this](Simulator::Outcome outcome) {
    perform(sonar_.on_ping(std::move(outcome), context_.clock.now()));
  });
}

void Device::report_visit(Role role, VisitLog::Kind kind, const std::string& what, std::vector<LogField> fields) {
  if (role == Role::client) return visits_.say(kind, what, std::move(fields));
  fields.insert(fields.begin(), {"sonar", config().name});
  say_at_times(context_.log, observer_visits_, LogLevel::info, what, std::move(fields));
}

void Device::carry_out(const Serve& action) {
  auto arrived = arrived_.extract(action.connection);
  if (arrived.empty()) return;
  Arrived& from = arrived.mapped();
  const Session::Setup setup{action.connection, context_.digest && from.role == Role::client, context_.config.limits, from.place};
  const auto session = std::make_shared<Session>(*this, std::move(from.socket), setup);
  const std::string& peer = sonar_.connections().find(action.connection)->peer.name;
  if (from.role == Role::client) {
    report_visit(from.role, VisitLog::Kind::connected, "client connected", {{"client", peer}});
    publish_client(peer, true, {});
  } else {
    report_visit(from.role, VisitLog::Kind::connected, "observer connected", {{"observer", peer}});
  }
  sessions_.push_back(session);
  session->start();
}

void Device::carry_out(const KeepWaiting&) {
  visits_.say(VisitLog::Kind::waits, "client waits for a place", {{"waiting", sonar_.connections().waiting()}});
}

void Device::carry_out(const TurnAway& action) {
  auto arrived = arrived_.extract(action.connection);
  if (arrived.empty()) return;
  Arrived& from = arrived.mapped();
  if (from.role == Role::observer) {
    const std::string most = std::to_string(config().max_observers);
    report_visit(from.role, VisitLog::Kind::turned_away, "observer turned away: " + most + " look on already", {});
    return close_politely(from.socket);
  }
  const std::string most = std::to_string(config().max_clients);
  report_visit(from.role, VisitLog::Kind::turned_away, "client turned away: " + most + " already connected", {});
  if (turning_away_ >= most_turned_away_at_once || stopping_) return;
  ++turning_away_;
  asio::co_spawn(
      context_.io,
      [this, s = std::move(from.socket), p = std::move(from.place)]() mutable { return turn_away(std::move(s), std::move(p)); },
      [this](std::exception_ptr fault) {
        if (fault) report_fault(text_of(fault));
        --turning_away_;
        context_.on_change();
      });
}

void Device::carry_out(const Wake& action) {
  if (const SessionPointer session = session_of(action.connection)) session->wake();
}

void Device::carry_out(const Finish& action) {
  if (const SessionPointer session = session_of(action.connection)) session->finish(action.why);
}

void Device::carry_out(const Reset& action) {
  if (const SessionPointer session = session_of(action.connection)) return session->reset(action.why);
  if (arrived_.erase(action.connection) > 0) perform(sonar_.on_closed(action.connection, action.why, context_.clock.now()));
}

void Device::carry_out(const Closed& action) {
  if (!action.served) {
    if (!stopping_)
      visits_.say(VisitLog::Kind::gone, "client gone: " + action.why, {{"waiting", sonar_.connections().waiting()}});
  } else if (action.observer) {
    report_visit(Role::observer, VisitLog::Kind::gone, "observer gone: " + action.why, {{"observer", action.peer}});
  } else {
    report_visit(Role::client, VisitLog::Kind::gone, "client gone: " + action.why,
                 {{"client", action.peer}, {"pings", action.pings_written}, {"dropped", action.pings_dropped}});
    publish_client(action.peer, false, action.why);
  }
}

void Device::carry_out(const PingQueued& action) {
  const Time now = context_.clock.now();
  const std::string& name = config().name;
  if (context_.recordings.takes(name))
    context_.recordings.take(name,
                             {now, action.ping, action.bytes, sonar_.vendor().beacon(sonar_.state(), now), computed_names_});
  publish_ping(action);
}

void Device::carry_out(const Report& action) {
  LogLimiter& limiter = limiters_[static_cast<std::size_t>(action.topic)];
  say_at_times(context_.log, limiter, action.line.level, action.line.phrase, action.line.fields);
}

void Device::carry_out(const EngineFailed& action) { context_.on_failure(action.why); }

}  // namespace sonar
