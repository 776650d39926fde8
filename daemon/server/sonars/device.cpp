#include "daemon/server/sonars/device.hpp"

#include <algorithm>

#include "daemon/server/connections/input_rate.hpp"
#include "daemon/server/system/listen.hpp"

namespace sonar {
namespace {

constexpr int most_refused_at_once = 16;

}  // namespace

Device::Device(DeviceNetwork& network, Sonar::Surroundings around, const SonarConfig& config, std::uint32_t index,
               DeviceParent& parent)
    : network_(network),
      parent_(parent),
      limits_(around.config.limits),
      hosts_(around.config.control.hosts),
      sonar_(around, config, index, network.clock.now(), network.clock.skipped()),
      observer_listener_(network.io, network.admission, Admission::Purpose::client),
      beacon_(
          network.io, network.log, config.name, [this] { return sonar_.beacons(network_.clock.now()); },
          [this](const std::string& fault) { on_fault(fault); }),
      timer_(network.io),
      visits_(network.io, network.log, config.name) {}

Device::~Device() = default;

// ---- ports

Result<void> Device::open() {
  for (const protocol::Port& port : sonar_.vendor().ports())
    if (auto r = open(port); !r) return r;
  return open_observers();
}

/// Opens a port, with its own listener or socket. But ports of kind udp_stream, udp_dialogue and udp_answer with equal numbers
/// share a socket.
Result<void> Device::open(const protocol::Port& port) {
  using Kind = protocol::Port::Kind;
  const Ipv4 ip = config().bind_ip;
  if (port.kind == Kind::tcp_stream)  // on_client_socket() calls `admission`, so that refusals are counted for this sonar
    return tcp_ports_.emplace_back(&port, Listener(network_.io, network_.admission, std::nullopt))
        .listener.open({ip, port.number});
  if (port.kind == Kind::udp_beacon) return beacon_.open(config(), port);
  if (port.kind == Kind::http) {
    const auto answer = [this, &port](const protocol::ResourceRequest& request) {
      Sonar::HttpAnswer made = sonar_.on_http(port, request, network_.clock.now());
      perform(std::move(made.actions));
      return std::move(made.reply);
    };
    const auto names = [this] {
      std::vector<std::string> all = hosts_;
      all.push_back(sonar::text_of(config().advertise_ip));
      return all;
    };
    return http_.emplace_back(network_.io, limits_, network_.admission, network_.log, config().name, names, answer)
        .open({ip, port.number});
  }
  auto datagrams = datagram_port(port.number);
  if (!datagrams) return tl::make_unexpected(datagrams.error());
  if (port.kind == Kind::udp_dialogue) {
    (*datagrams)->answer_with([this, at = *datagrams, &port](Endpoint from, protocol::BytesView datagram) {
      return on_limited_datagram(from, datagram, [&] {
        on_host_datagram(*at, port, from, datagram);
        return std::vector<protocol::Bytes>{};
      });
    });
    (*datagrams)->on_port_unreachable([this, &port](Endpoint host) { on_host_closed(port, host); });
    return {};
  }
  if (port.kind == Kind::udp_answer) {
    (*datagrams)->receive_broadcasts(config());
    (*datagrams)->answer_with([this, &port](Endpoint from, protocol::BytesView datagram) {
      return on_limited_datagram(from, datagram, [&] {
        Sonar::Answers answers = sonar_.on_datagram(port, from, datagram, network_.clock.now());
        perform(std::move(answers.actions));
        if (!answers.datagrams.empty()) searched_ = Visit{text_of(from), {}};
        return std::move(answers.datagrams);
      });
    });
    return {};
  }
  (*datagrams)->on_port_unreachable([this](Endpoint receiver) { on_receiver_closed(receiver); });
  const ConnectionId id = ++last_connection_;
  streams_.push_back(std::make_shared<DatagramStream>(*this, (*datagrams)->socket(), id, port.gap));
  perform(sonar_.open_stream(id, port, network_.clock.now()));
  return {};
}

/// Returns the socket of a port number; several ports can share it.
Result<DatagramPort*> Device::datagram_port(std::uint16_t number) {
  for (DatagramPort& port : datagram_ports_)
    if (number != 0 && port.number() == number) return &port;
  DatagramPort& port = datagram_ports_.emplace_back(network_.io);
  // The port of discovery is shared, because hosts bind it too. If a sonar is started twice, its other ports are in use.
  const auto ports = sonar_.vendor().ports();
  const bool shared = std::any_of(ports.begin(), ports.end(), [&](const protocol::Port& p) {
    return p.kind == protocol::Port::Kind::udp_answer && p.number == number;
  });
  if (auto r = port.open(config(), number, shared); !r) return tl::make_unexpected(r.error());
  return &port;
}

Result<void> Device::open_observers() {
  if (config().max_observers == 0 || tcp_ports_.empty()) return {};
  if (auto r = observer_listener_.open({config().bind_ip, config().observer_port}); !r)
    return failure(r.error().kind, r.error().text + "; observers: {port: 0} in the configuration selects any free port");
  return {};
}

Endpoint Device::data_endpoint() const { return tcp_ports_.empty() ? Endpoint{} : tcp_ports_.front().listener.at(); }

void Device::start() {
  started_ = true;
  const auto fault = [this](const std::string& what) { on_fault(what); };
  for (TcpPort& tcp : tcp_ports_)
    tcp.listener.start(
        [this, port = tcp.port](tcp::socket socket) {
          admit(std::move(socket), [this, port](tcp::socket admitted) { on_client_socket(std::move(admitted), *port); });
        },
        fault);
  observer_listener_.start(
      [this](tcp::socket socket) {
        admit(std::move(socket),
              [this](tcp::socket admitted) { on_arrival(std::move(admitted), {}, Role::observer, tcp_ports_.front().port); });
      },
      fault);
  for (DatagramPort& port : datagram_ports_) port.start();
  for (SonarHttp& http : http_) http.start();
  for (const StreamPointer& stream : streams_) stream->start();
  beacon_.start();
  arm();
}

void Device::stop(const std::string& why) {
  if (std::exchange(stopping_, true)) return;
  // Listeners are closed first, so that no client arrives while the present clients are disconnected.
  for (TcpPort& tcp : tcp_ports_) tcp.listener.stop();
  observer_listener_.stop();
  beacon_.stop();
  timer_.cancel();
  for (SonarHttp& http : http_) http.stop();
  visits_.end();
  if (started_) parent_.on_stop(*this, why);  // a device that was never started may have the name of a running device
  perform(sonar_.stop(why));
  for (DatagramPort& port : datagram_ports_) port.stop();
  if (!started_) streams_.clear();
}

/// True if no part of the device uses a socket any more, so that the device can be destroyed.
bool Device::gone() const {
  return sessions_.empty() && streams_.empty() && refusing_ == 0 && waiting_ == 0 && !sonar_.busy() &&
         std::all_of(http_.begin(), http_.end(), [](const SonarHttp& http) { return http.gone(); });
}

// ---- sessions

Device::SessionPointer Device::session_of(ConnectionId id) const {
  const auto it = std::find_if(sessions_.begin(), sessions_.end(), [&](const SessionPointer& s) { return s->id() == id; });
  return it == sessions_.end() ? nullptr : *it;
}

Device::StreamPointer Device::stream_of(ConnectionId id) const {
  const auto it = std::find_if(streams_.begin(), streams_.end(), [&](const StreamPointer& s) { return s->id() == id; });
  return it == streams_.end() ? nullptr : *it;
}

std::size_t Device::on_bytes(ConnectionId from, protocol::BytesView bytes) {
  perform(sonar_.on_bytes(from, bytes, network_.clock.now()));
  return work::of_reaction * sonar_.take_reactions();
}

void Device::on_written(ConnectionId to, const Outbox::Message& message) {
  sonar_.on_written(to, message, network_.clock.now());
  parent_.on_change();
}

void Device::on_not_sent(ConnectionId stream) {
  sonar_.on_not_sent(stream);
  parent_.on_change();
}

std::optional<std::chrono::milliseconds> Device::longest_silence(ConnectionId of) const {
  const Connection* const connection = sonar_.connections().find(of);
  return connection == nullptr || !connection->dialogue ? std::nullopt : connection->dialogue->longest_silence();
}

/// Reports a bug of sonard (not a mistake of a client). A bug may end the connection of one client, but no other.
void Device::on_fault(const std::string& what) { log_fault(network_.log, faults_, what, {"sonar", config().name}); }

void Device::on_send_error(const Endpoint& to, const std::string& why) {
  log_limited(network_.log, send_errors_, LogLevel::warning, "cannot send pings: " + why,
              {{"sonar", config().name}, {"to", text_of(to)}});
}

void Device::on_over(ConnectionId id, const std::string& why, bool by_client) {
  const Connection* const connection = sonar_.connections().find(id);
  const SessionPointer session = session_of(id);
  if (network_.digest && session && connection != nullptr && connection->role == Role::client)
    digests_.push_back({connection->number, session->digest().size(), session->digest().hex()});
  std::chrono::nanoseconds lasted{};
  if (session) lasted = session->connected_for();
  if (const StreamPointer dialogue = stream_of(id)) lasted = dialogue->connected_for();
  sessions_.remove(session);
  streams_.remove_if([id](const StreamPointer& s) { return s->id() == id; });
  // This precedes the assignment of the free slot, because a waiting client may have disconnected.
  forget_who_left();
  closing_since_ = std::chrono::steady_clock::now() - lasted;
  perform(sonar_.on_closed(id, why, network_.clock.now(), by_client));
}

// ---- actions

/// Carries out actions in order, because later actions may refer to the session that a Serve creates.
void Device::perform(Actions actions) {
  for (Action& action : actions) std::visit([this](auto& a) { carry_out(a); }, action);
  arm();
  parent_.on_change();
}

void Device::arm() {
  // In stepped time the Stepper calls the sonar's ticks.
  if (stopping_ || network_.clock.stepped()) return;
  const auto next = sonar_.next_tick();
  const auto at = next ? std::optional(network_.clock.timer_at(*next)) : std::nullopt;
  if (at == timer_at_) return;
  timer_at_ = at;
  if (!at) return static_cast<void>(timer_.cancel());
  timer_.expires_at(*at);
  timer_.async_wait([this](const error_code& ec) {
    if (ec || stopping_) return;
    timer_at_.reset();
    perform(sonar_.on_tick(network_.clock.now()));
  });
}

void Device::carry_out(ComputePing& action) {
  parent_.compute(*this, std::move(action.request),
                  [this](Simulator::Outcome outcome) { perform(sonar_.on_ping(std::move(outcome), network_.clock.now())); });
}

void Device::report_visit(Role role, VisitLog::Kind kind, const std::string& what, std::vector<LogField> fields) {
  if (role == Role::client) return visits_.say(kind, what, std::move(fields));
  fields.insert(fields.begin(), {"sonar", config().name});
  log_limited(network_.log, observer_visits_, LogLevel::info, what, std::move(fields));
}

void Device::carry_out(const Serve& action) {
  auto arrived = arrived_.extract(action.connection);
  if (arrived.empty()) return;
  Arrived& from = arrived.mapped();
  const Session::Setup setup{action.connection, network_.digest && from.role == Role::client, limits_, from.place};
  const auto session = std::make_shared<Session>(*this, std::move(from.socket), setup);
  const std::string& peer = sonar_.connections().find(action.connection)->peer.name;
  if (from.role == Role::client) {
    report_visit(from.role, VisitLog::Kind::connected, "client connected", {{"client", peer}});
    parent_.on_client(*this, peer, true, {});
  } else {
    report_visit(from.role, VisitLog::Kind::connected, "observer connected", {{"observer", peer}});
  }
  sessions_.push_back(session);
  session->start();
}

void Device::carry_out(const KeepWaiting&) {
  visits_.say(VisitLog::Kind::waits, "client waits for a slot", {{"waiting", sonar_.connections().waiting()}});
}

void Device::carry_out(const Refuse& action) {
  auto arrived = arrived_.extract(action.connection);
  if (arrived.empty()) return;
  Arrived& from = arrived.mapped();
  if (from.role == Role::client)
    refused_ = Visit{peer_of(from.socket).name, action.reset ? "reset by a fault" : "no slot is free"};
  if (action.reset) {
    report_visit(from.role, VisitLog::Kind::refused, "client refused: reset", {});
    return close_by_reset(from.socket);
  }
  if (from.role == Role::observer) {
    const std::string most = std::to_string(config().max_observers);
    report_visit(from.role, VisitLog::Kind::refused, "observer refused: " + most + " observers connected", {});
    return close_politely(from.socket);
  }
  const std::string most = std::to_string(config().max_clients);
  report_visit(from.role, VisitLog::Kind::refused, "client refused: " + most + " already connected", {});
  // Beyond the limit the socket is closed without reading, so the client may get RST, not FIN.
  if (refusing_ >= most_refused_at_once || stopping_) return;
  ++refusing_;
  asio::co_spawn(
      network_.io,
      [this, s = std::move(from.socket), p = std::move(from.place)]() mutable { return refuse(std::move(s), std::move(p)); },
      [this](std::exception_ptr fault) {
        if (fault) on_fault(text_of(fault));
        --refusing_;
        parent_.on_change();
      });
}

void Device::carry_out(const Listen& action) {
  const auto taken = [this](const std::string& why) { network_.log.warning(why, {{"sonar", config().name}}); };
  for (TcpPort& tcp : tcp_ports_) {
    if (action.on)
      tcp.listener.resume(taken);
    else
      tcp.listener.pause();
  }
}

void Device::carry_out(const ReadFrom& action) {
  if (const SessionPointer session = session_of(action.connection)) session->read_from_client(action.on);
}

void Device::carry_out(const EndPauses& action) {
  if (const SessionPointer session = session_of(action.connection)) session->end_pauses();
}

void Device::carry_out(const Wake& action) {
  if (const SessionPointer session = session_of(action.connection)) return session->wake();
  if (const StreamPointer stream = stream_of(action.connection)) stream->wake();
}

void Device::carry_out(const Finish& action) {
  if (const SessionPointer session = session_of(action.connection)) return session->finish(action.why);
  if (const StreamPointer stream = stream_of(action.connection)) stream->finish(action.why);
}

void Device::carry_out(const Reset& action) {
  if (const SessionPointer session = session_of(action.connection)) return session->reset(action.why);
  if (const StreamPointer stream = stream_of(action.connection)) return stream->finish(action.why);
  if (arrived_.erase(action.connection) > 0) perform(sonar_.on_closed(action.connection, action.why, network_.clock.now()));
}

void Device::carry_out(const Closed& action) {
  if (action.role == Role::stream) return;
  if (!action.served) {
    if (!stopping_)
      visits_.say(VisitLog::Kind::gone, "client gone: " + action.why, {{"waiting", sonar_.connections().waiting()}});
  } else if (action.role == Role::observer) {
    report_visit(Role::observer, VisitLog::Kind::gone, "observer gone: " + action.why, {{"observer", action.peer}});
  } else {
    gone_ = Visit{action.peer, action.why};
    gone_->by_itself = action.by_client;
    gone_->without_ping = action.pings_written == 0 && !action.for_commands;
    gone_->connected_at = closing_since_;
    report_visit(Role::client, VisitLog::Kind::gone, "client gone: " + action.why,
                 {{"client", action.peer}, {"pings", action.pings_written}, {"dropped", action.pings_dropped}});
    parent_.on_client(*this, action.peer, false, action.why);
  }
}

void Device::carry_out(const PingQueued& action) {
  made_.add(action.ping->request.fired_at);
  parent_.on_ping_queued(*this, action);
}

void Device::carry_out(const Report& action) {
  LogLimiter& limiter = limiters_[static_cast<std::size_t>(action.topic)];
  log_limited(network_.log, limiter, action.line.level, action.line.phrase, action.line.fields);
}

}  // namespace sonar
