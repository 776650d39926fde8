// The hosts to which a Device sends datagrams: hosts of dialogues (ports of kind udp_dialogue) and receivers of streams
// (udp_stream).

#include <algorithm>
#include <array>

#include "daemon/config/sonar_addresses.hpp"
#include "daemon/server/connections/input_rate.hpp"
#include "daemon/server/sonars/device.hpp"
#include "daemon/server/system/listen.hpp"

namespace sonar {
namespace {

constexpr std::chrono::seconds closed_for{2};  // time after which a receiver whose port was closed gets one ping as a test
constexpr std::uint16_t discard = 9;           // a port that is usually closed (RFC 863)
constexpr std::size_t most_closed = 64;

}  // namespace

/// Returns the receivers that clients requested, except group addresses that neither the product nor the configuration names, and
/// receivers whose port is closed.
std::vector<Endpoint> Device::receivers(ConnectionId stream) {
  const Connection* const connection = sonar_.connections().find(stream);
  std::vector<Endpoint> all = sonar_.receivers(stream);
  if (connection == nullptr || connection->role != Role::stream) return all;
  std::erase_if(all, [&](const Endpoint& to) {
    if (may_receive(to.ip, *connection->port, config())) return false;
    on_send_error(to, "a broadcast or multicast address, which sonars.groups of the configuration does not name");
    return true;
  });
  const auto now = std::chrono::steady_clock::now();
  closed_.remove_if([now](const auto& c) { return c.second <= now; });
  std::erase_if(all, [&](const Endpoint& to) {
    return std::any_of(closed_.begin(), closed_.end(), [&](const auto& c) { return c.first == to; });
  });
  return all;
}

void Device::on_receiver_closed(const Endpoint& receiver) {
  const bool known = std::any_of(closed_.begin(), closed_.end(), [&](const auto& c) { return c.first == receiver; });
  if (!known && closed_.size() < most_closed) closed_.emplace_back(receiver, std::chrono::steady_clock::now() + closed_for);
}

/// Probes a silent host with a datagram to a closed port. An answer (ICMP) of the host's computer counts as a sign of life.
void Device::look_for_host(ConnectionId stream) {
  const Connection* const host = sonar_.connections().find(stream);
  const StreamPointer dialogue = stream_of(stream);
  if (host == nullptr || !dialogue || !host->dialogue || !host->dialogue->hosts_fall_silent()) return;
  dialogue->send_nothing_to({host->peer.ip, discard});
}

/// Handles a datagram. Returns nullopt if it was dropped because the requests of the address cost too much.
std::optional<std::vector<protocol::Bytes>> Device::on_limited_datagram(
    const Endpoint& from, protocol::BytesView datagram, const std::function<std::vector<protocol::Bytes>()>& act) {
  PortGuard& guard = network_.admission.guard();
  const std::string ip = sonar::text_of(from.ip);
  const auto now = std::chrono::steady_clock::now();
  if (!guard.takes_datagram(ip, datagram.size(), limits_.input_bytes_per_s, now)) {
    log_limited(network_.log, storms_, LogLevel::warning, "datagrams dropped: their address sends too many requests",
                {{"sonar", config().name}, {"address", ip}});
    return std::nullopt;
  }
  datagram_work_ = 0;
  std::vector<protocol::Bytes> answers = act();
  guard.count(ip, datagram_work_ + work::of_reaction * answers.size(), limits_.input_bytes_per_s, now);
  return answers;
}

/// Passes a datagram to the dialogue, which belongs to the last sender, because UDP has no connection whose end would show that a
/// host has gone.
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
  datagram_work_ = on_bytes(dialogue->id(), datagram);
}

/// Called when a host's computer has answered that a port is closed. If it is the host's own port, the host has ended, which UDP
/// does not show otherwise; if it is the port of look_for_host(), the host is alive.
void Device::on_host_closed(const protocol::Port& port, const Endpoint& host) {
  const StreamPointer dialogue = host_of(port);
  if (!dialogue) return;
  const Peer& last = sonar_.connections().find(dialogue->id())->peer;
  if (last.ip != host.ip) return;
  if (last.port == host.port)
    dialogue->finish("its port is closed", true);
  else if (host.port == discard)
    dialogue->heard();
}

Device::StreamPointer Device::host_of(const protocol::Port& port) const {
  for (const StreamPointer& stream : streams_) {
    const Connection* const c = sonar_.connections().find(stream->id());
    if (c != nullptr && c->role == Role::client && c->port == &port && !c->finishing) return stream;
  }
  return nullptr;
}

/// Begins a dialogue; returns null if no slot is free, because datagrams do not wait for a slot.
Device::StreamPointer Device::begin_dialogue(DatagramPort& at, const protocol::Port& port, Peer host) {
  const ConnectionId id = ++last_connection_;
  perform(sonar_.on_connect(id, Role::client, host, network_.clock.now(), &port));
  const Connection* const connection = sonar_.connections().find(id);
  if (connection == nullptr || connection->state != Connection::State::served) {
    refused_ = Visit{host.name, "no slot is free"};
    if (connection != nullptr) perform(sonar_.on_closed(id, "no slot is free", network_.clock.now()));
    return nullptr;
  }
  report_visit(Role::client, VisitLog::Kind::connected, "client connected", {{"client", host.name}});
  parent_.on_client(*this, host.name, true, {});
  streams_.push_back(std::make_shared<DatagramStream>(*this, at.socket(), id, port.gap));
  streams_.back()->start();
  return streams_.back();
}

// Handles new connections at the TCP ports of a Device, until the sonar has accepted or refused them.

/// Delays a host that connects too often (a driver that reconnects at once must not fail). Only a few connections of an address
/// wait; others are refused.
void Device::admit(tcp::socket socket, OnAdmitted serve) {
  constexpr int most_waiting = 8;
  error_code ec;
  const std::string ip = socket.remote_endpoint(ec).address().to_string();
  const auto pause =
      network_.admission.guard().pause_before_connection(ip, limits_.input_bytes_per_s, std::chrono::steady_clock::now());
  if (pause.count() == 0) return serve(std::move(socket));
  log_limited(
      network_.log, storms_, LogLevel::warning, "client delayed: its address connects too often",
      {{"sonar", config().name}, {"address", ip}, {"limit_per_s", PortGuard::connections_per_s(limits_.input_bytes_per_s)}});
  if (waiting_ >= most_waiting || stopping_) {
    sonar_.count_refused_client();
    refused_ = Visit{ip, "it connects too often"};
    return;
  }
  ++waiting_;
  asio::co_spawn(
      network_.io,
      [this, s = std::move(socket), pause, then = std::move(serve)]() mutable {
        return serve_later(std::move(s), pause, std::move(then));
      },
      [this](std::exception_ptr fault) {
        if (fault) on_fault(text_of(fault));
        --waiting_;
        parent_.on_change();
      });
}

asio::awaitable<void> Device::serve_later(tcp::socket socket, std::chrono::steady_clock::duration pause, OnAdmitted serve) {
  asio::steady_timer timer(network_.io, pause);
  error_code ec;
  co_await timer.async_wait(into(ec));
  if (!stopping_) serve(std::move(socket));
}

void Device::on_client_socket(tcp::socket socket, const protocol::Port& port) {
  if (auto place = network_.admission.enter(socket)) return on_arrival(std::move(socket), std::move(place), Role::client, &port);
  sonar_.count_refused_client();
  refused_ = Visit{peer_of(socket).name, "sonard has no descriptor or slot left for it"};
  close_politely(socket);
}

void Device::on_arrival(tcp::socket socket, Admission::Place place, Role role, const protocol::Port* port) {
  // Frees the slots of clients that have disconnected, before it accepts or refuses this client.
  forget_who_left();
  const ConnectionId id = ++last_connection_;
  Peer peer = peer_of(socket);
  arrived_.emplace(id, Arrived{std::move(socket), std::move(place), role});
  perform(sonar_.on_connect(id, role, std::move(peer), network_.clock.now(), port));
}

/// Sends FIN and no bytes. First reads what the client has sent, because with unread bytes the kernel would send RST.
asio::awaitable<void> Device::refuse(tcp::socket socket, Admission::Place place) {
  error_code ec;
  socket.shutdown(tcp::socket::shutdown_send, ec);
  bool late = false;
  asio::steady_timer deadline(network_.io, std::chrono::seconds(1));
  deadline.async_wait([&socket, &late](const error_code& e) {
    if (e) return;
    late = true;  // a read that has just ended cannot be cancelled, and the next read would never end
    socket.cancel();
  });
  std::array<std::byte, 1024> discarded;
  for (int reads = 0; !ec && !late && reads < 64; ++reads) co_await socket.async_read_some(asio::buffer(discarded), into(ec));
  deadline.cancel();
  // The handler above uses `socket`, so it must end before this coroutine frame is destroyed.
  co_await asio::post(network_.io, asio::use_awaitable);
  socket.close(ec);  // closed before its slot is free
  place.reset();
}

void Device::forget_who_left() {
  std::vector<ConnectionId> left;
  for (auto& [id, arrived] : arrived_)
    if (has_left(arrived.socket)) left.push_back(id);
  for (const ConnectionId id : left) {
    arrived_.erase(id);
    perform(sonar_.on_closed(id, "it waited for a slot", network_.clock.now()));
  }
  for (const SessionPointer& session : std::vector(sessions_.begin(), sessions_.end())) session->end_if_closed();
}

}  // namespace sonar
