// The accepting half of both control servers: a listener, and places for connections that are given up by the most silent. Where
// a token is needed, those who have not shown it yet have places of their own, and push out each other only, first those of the
// address that holds most. What a Connection does with its socket is its own business.
#pragma once

#include <string>

#include "daemon/config/places.hpp"
#include "daemon/control/control_context.hpp"
#include "daemon/system/listen.hpp"

namespace sonar {

template <class Connection>
class ConnectionDoor {
 public:
  /// `protocol` names it in the log: "control", "http".
  ConnectionDoor(ControlContext& context, std::string protocol)
      : context_(context),
        protocol_(std::move(protocol)),
        acceptor_(context.io),
        places_(static_cast<std::size_t>(context.limits.control_clients)) {}

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
    places_.close_all();
    strangers_.close_all();
    leaving_.close_all();
  }
  /// Port 0 = not listening.
  Endpoint at() const { return at_; }

 private:
  using Steady = std::chrono::steady_clock;
  static constexpr std::size_t most_strangers = 16, most_leaving = 16;

  void keep_accepting() {
    asio::co_spawn(
        context_.io, [this] { return accept(); },
        [this](std::exception_ptr fault) {
          if (!fault || stopping_) return;
          say_fault(context_, fault, protocol_ + " connections");
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
    if (ec) return;  // gone already
    const std::string address = peer.address().to_string();
    const Sender sender{protocol_ + " tcp " + address + ":" + std::to_string(peer.port()), protocol_ + " " + address};
    const bool stranger = context_.token.needed();
    Places<Connection>& places = stranger ? strangers_ : places_;
    if (!make_room(places, sender)) return turn_away(std::move(socket), sender);
    end_when_silent(socket, context_.limits.dead_peer);
    socket.set_option(tcp::no_delay(true), ec);
    auto connection = std::make_shared<Connection>(context_, std::move(socket), sender);
    places.add(connection);
    if (stranger) connection->asks_for_place([this, weak = std::weak_ptr(connection)] { return let_in(weak.lock()); });
    run(connection, connection->read());
    run(connection, connection->write());
  }
  bool make_room(Places<Connection>& places, const Sender& sender) {
    const bool room = places.make_room([this](const Connection& evicted) {
      say_at_times(context_.log, context_.notices, LogLevel::info,
                   "control connection closed: silent for longest, and its place was needed", {{"from", evicted.sender().id}});
    });
    if (!room) say_refused(context_, std::to_string(places.most()) + " connections are open and busy already", sender.id);
    return room;
  }
  /// It has shown the token. False: there is no place.
  bool let_in(const std::shared_ptr<Connection>& connection) {
    if (!make_room(places_, connection->sender())) return false;
    strangers_.remove(connection);
    places_.add(connection);
    return true;
  }
  /// It is told why, and lives for a moment; beyond so many it is closed without a word.
  void turn_away(tcp::socket socket, const Sender& sender) {
    if (!leaving_.make_room([](const Connection&) {})) return;
    auto connection = std::make_shared<Connection>(context_, std::move(socket), sender);
    connection->turn_away();
    leaving_.add(connection);
    run(connection, connection->read());
    run(connection, connection->write());
  }
  /// One of its coroutines. A fault of ours ends this connection and no other.
  void run(const std::shared_ptr<Connection>& connection, asio::awaitable<void> part) {
    asio::co_spawn(context_.io, std::move(part), [this, connection](std::exception_ptr fault) {
      if (fault) say_fault(context_, fault, connection->sender().id);
      if (fault) connection->close();
      if (!connection->over()) return;
      places_.remove(connection);
      strangers_.remove(connection);
      leaving_.remove(connection);
    });
  }

  ControlContext& context_;
  std::string protocol_;
  tcp::acceptor acceptor_;
  Places<Connection> places_, leaving_{most_leaving};
  Places<Connection> strangers_{most_strangers, Steady::duration{}, [](const Connection& c) { return c.sender().source; }};
  Endpoint at_;
  bool stopping_ = false;
};

}  // namespace sonar
