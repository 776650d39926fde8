// Handles new connections at the TCP ports of a Device, until the sonar has accepted or refused them.
#include <array>

#include "daemon/server/sonars/device.hpp"
#include "daemon/server/system/listen.hpp"

namespace sonar {

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
