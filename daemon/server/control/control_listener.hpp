// The listener of both control servers. Each connection holds a slot; when all are taken, the longest idle connection is closed.
// Where a token is required, clients that have not shown it yet share slots of their own, so that they can only evict each
// other, first those of the address with most connections. The Connection class reads and writes the socket.
#pragma once

#include <string>

#include "daemon/server/control/control_context.hpp"
#include "daemon/server/system/connection_slots.hpp"
#include "daemon/server/system/listen.hpp"

namespace sonar {

template <class Connection>
class ControlListener {
 public:
  /// `protocol` is its name in the log: "control", "http".
  ControlListener(ControlContext& context, std::string protocol)
      : context_(context),
        protocol_(std::move(protocol)),
        acceptor_(context.io),
        slots_(static_cast<std::size_t>(context.limits.control_clients)) {}

  Result<void> open(Endpoint at) {
    if (auto r = listen_tcp(acceptor_, at); !r) {
      error_code ec;
      acceptor_.close(ec);
      return r;
    }
    at.port = acceptor_.local_endpoint().port();
    at_ = at;
    return {};
  }
  void start() {
    if (acceptor_.is_open()) keep_accepting();
  }
  void stop() {
    stopping_ = true;
    error_code ec;
    acceptor_.close(ec);
    slots_.close_all();
    untrusted_.close_all();
    rejected_.close_all();
  }
  /// Port 0 = not listening.
  Endpoint at() const { return at_; }

 private:
  using Steady = std::chrono::steady_clock;
  static constexpr std::size_t most_untrusted = 16, most_rejected = 16;

  void keep_accepting() {
    asio::co_spawn(
        context_.io, [this] { return accept(); },
        [this](std::exception_ptr fault) {
          if (!fault || stopping_) return;
          log_fault(context_, fault, protocol_ + " connections");
          keep_accepting();
        });
  }
  asio::awaitable<void> accept() {
    while (auto socket = co_await context_.admission.next_visitor(acceptor_, Admission::Purpose::control)) {
      if (stopping_) co_return;
      admit(*std::move(socket));
    }
  }
  void admit(tcp::socket socket) {
    error_code ec;
    const auto peer = socket.remote_endpoint(ec);
    if (ec) return;  // closed already
    const std::string address = peer.address().to_string();
    const Sender sender{protocol_ + " tcp " + address + ":" + std::to_string(peer.port()), protocol_ + " " + address};
    const bool untrusted = context_.token.needed();
    ConnectionSlots<Connection>& slots = untrusted ? untrusted_ : slots_;
    if (!make_room(slots, sender)) return reject(std::move(socket), sender);
    end_when_silent(socket, context_.limits.dead_peer);
    socket.set_option(tcp::no_delay(true), ec);
    auto connection = std::make_shared<Connection>(context_, std::move(socket), sender);
    slots.add(connection);
    if (untrusted) connection->must_claim_slot([this, weak = std::weak_ptr(connection)] { return claim_slot(weak.lock()); });
    run(connection, connection->read());
    run(connection, connection->write());
  }
  bool make_room(ConnectionSlots<Connection>& slots, const Sender& sender) {
    const bool room = slots.make_room([this](const Connection& evicted) {
      say_at_times(context_.log, context_.notices, LogLevel::info,
                   "control connection closed: longest idle, and its slot was needed", {{"from", evicted.sender().id}});
    });
    if (!room) log_refusal(context_, "all " + std::to_string(slots.most()) + " connection slots are in use", sender.id);
    return room;
  }
  /// After the client has shown the token. False: no slot is free.
  bool claim_slot(const std::shared_ptr<Connection>& connection) {
    if (!make_room(slots_, connection->sender())) return false;
    untrusted_.remove(connection);
    slots_.add(connection);
    return true;
  }
  /// Sends the reason before closing; beyond most_rejected connections, closes at once.
  void reject(tcp::socket socket, const Sender& sender) {
    if (!rejected_.make_room([](const Connection&) {})) return;
    auto connection = std::make_shared<Connection>(context_, std::move(socket), sender);
    connection->reject();
    rejected_.add(connection);
    run(connection, connection->read());
    run(connection, connection->write());
  }
  /// Starts one of the connection's coroutines. An exception ends this connection only.
  void run(const std::shared_ptr<Connection>& connection, asio::awaitable<void> part) {
    asio::co_spawn(context_.io, std::move(part), [this, connection](std::exception_ptr fault) {
      if (fault) log_fault(context_, fault, connection->sender().id);
      if (fault) connection->close();
      if (!connection->over()) return;
      slots_.remove(connection);
      untrusted_.remove(connection);
      rejected_.remove(connection);
    });
  }

  ControlContext& context_;
  std::string protocol_;
  tcp::acceptor acceptor_;
  ConnectionSlots<Connection> slots_, rejected_{most_rejected};
  ConnectionSlots<Connection> untrusted_{most_untrusted, Steady::duration{},
                                         [](const Connection& c) { return c.sender().source; }};
  Endpoint at_;
  bool stopping_ = false;
};

}  // namespace sonar
