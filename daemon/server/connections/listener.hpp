// A listening TCP socket and its accept loop, for sonars, control and poses. An error of one connection does not end the loop.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "core/base/result.hpp"
#include "daemon/server/connections/admission.hpp"
#include "daemon/server/connections/connection_services.hpp"
#include "daemon/server/system/asio.hpp"
#include "daemon/server/system/listen.hpp"

namespace sonar {

class Listener {
 public:
  using Take = std::function<void(tcp::socket)>;
  using Fault = std::function<void(const std::string&)>;

  /// `purpose` selects the reserved descriptors that may be used; nullopt: the caller requests a slot of `admission`. `admission`
  /// must outlive the listener.
  Listener(asio::io_context& io, Admission& admission, std::optional<Admission::Purpose> purpose)
      : admission_(admission), purpose_(purpose), acceptor_(io), reopen_timer_(io) {}

  /// Opens the socket. With port 0 the system chooses a port. After an error the object does not listen.
  Result<void> open(Endpoint at);
  /// Passes each connection to `take`, and the text of an exception to `fault`. Does nothing if the listener is not open. The
  /// object must exist for 100 ms after stop(), the longest pause in Admission.
  void start(Take take, Fault fault);
  void stop();
  /// Closes the socket, so that connections are refused as at a port without a listener.
  void pause();
  /// Accepts connections again, at the same address and port. Retries while another program uses that port, and passes the reason
  /// to `taken` once.
  void resume(Fault taken);
  /// True also while paused.
  bool is_open() const { return acceptor_.is_open() || paused_; }
  /// Returns the address, with the port that the system chose. The port is 0 if the listener was never opened.
  Endpoint at() const { return at_; }

 private:
  asio::awaitable<void> accept();
  asio::awaitable<void> reopen();
  void try_to_open();

  Admission& admission_;
  std::optional<Admission::Purpose> purpose_;
  tcp::acceptor acceptor_;
  asio::steady_timer reopen_timer_;
  Endpoint at_;
  Take take_;
  Fault fault_, taken_;
  bool stopping_ = false, paused_ = false;
};

// A listener whose connections each hold a slot, for both control servers and the HTTP of sonars. If all slots are in use, a new
// connection evicts another (ConnectionSlots selects it). If a token is required, clients that have not sent it yet have
// separate slots, so that they can only evict each other, first clients of the address with most connections. The Connection
// class reads and writes the socket.

template <class Connection>
class ConnectionListener {
 public:
  using Make = std::function<std::shared_ptr<Connection>(tcp::socket, Sender)>;

  /// `protocol`: name of the protocol in the log, such as "protobuf" or "http". `services` must outlive the listener.
  ConnectionListener(ConnectionServices& services, std::string protocol, Make make)
      : services_(services),
        protocol_(std::move(protocol)),
        make_(std::move(make)),
        listener_(services.io, services.admission, services.purpose),
        slots_(static_cast<std::size_t>(services.limits.control_clients), std::chrono::seconds(1), address_of_client) {}

  Result<void> open(Endpoint at) { return listener_.open(at); }
  void start() {
    listener_.start([this](tcp::socket socket) { admit(std::move(socket)); },
                    [this](const std::string& fault) { log_fault(services_, fault, protocol_ + " connections"); });
  }
  void stop() {
    listener_.stop();
    slots_.close_all();
    untrusted_.close_all();
    rejected_.close_all();
  }
  /// Returns the address; port 0 = not listening.
  Endpoint at() const { return listener_.at(); }
  bool is_open() const { return listener_.is_open(); }
  /// True after stop() if no connection is left.
  bool gone() const { return running_ == 0; }

 private:
  using Steady = std::chrono::steady_clock;
  static constexpr std::size_t most_untrusted = 16, most_rejected = 16;
  static std::string address_of_client(const Connection& c) { return c.sender().source; }

  void admit(tcp::socket socket) {
    error_code ec;
    const auto peer = socket.remote_endpoint(ec);
    if (ec) return;  // the socket is closed already
    const std::string address = peer.address().to_string();
    const Sender sender{protocol_ + " tcp " + address + ":" + std::to_string(peer.port()), protocol_ + " " + address};
    const bool untrusted = services_.token.needed();
    ConnectionSlots<Connection>& slots = untrusted ? untrusted_ : slots_;
    // Clients of sonars count for limits.clients; control has separate slots.
    Admission::Place place;
    if (services_.purpose == Admission::Purpose::client) {
      place = services_.admission.enter(socket);
      if (!place) return close_politely(socket);
    }
    if (services_.admission.is_drivers(socket)) slots.evict(sender.source, [this](const Connection& c) { say_evicted(c); });
    if (!make_room(slots, sender)) return reject(std::move(socket), sender);
    end_when_silent(socket, services_.limits.dead_peer);
    socket.set_option(tcp::no_delay(true), ec);
    auto connection = make_(std::move(socket), sender);
    slots.add(connection);
    if (untrusted) connection->must_claim_slot([this, weak = std::weak_ptr(connection)] { return claim_slot(weak.lock()); });
    run(connection, connection->read(), place);
    run(connection, connection->write(), place);
  }
  bool make_room(ConnectionSlots<Connection>& slots, const Sender& sender) {
    const bool room = slots.make_room(sender.source, [this](const Connection& evicted) { say_evicted(evicted); });
    if (!room) log_refusal(services_, "all " + std::to_string(slots.most()) + " connection slots are in use", sender.id);
    return room;
  }
  void say_evicted(const Connection& evicted) {
    log_limited(services_.log, services_.notices, LogLevel::info,
                services_.server + " connection closed: another client needs the slot, and it was idle longest",
                {{"from", evicted.sender().id}});
  }
  /// Moves a client that has sent the token to the slots for such clients. Returns false if no slot is free.
  bool claim_slot(const std::shared_ptr<Connection>& connection) {
    if (!make_room(slots_, connection->sender())) return false;
    untrusted_.remove(connection);
    slots_.add(connection);
    return true;
  }
  /// Sends the reason, then closes; beyond most_rejected connections, closes at once.
  void reject(tcp::socket socket, const Sender& sender) {
    if (!rejected_.make_room(sender.source, [](const Connection&) {})) return;
    auto connection = make_(std::move(socket), sender);
    connection->reject();
    rejected_.add(connection);
    run(connection, connection->read());
    run(connection, connection->write());
  }
  /// Starts one of the connection's coroutines. An exception ends this connection only.
  void run(const std::shared_ptr<Connection>& connection, asio::awaitable<void> part, Admission::Place place = {}) {
    ++running_;
    asio::co_spawn(services_.io, std::move(part), [this, connection, place = std::move(place)](std::exception_ptr fault) {
      --running_;
      if (fault) log_fault(services_, text_of(fault), connection->sender().id);
      if (fault) connection->close();
      if (!connection->over()) return;
      slots_.remove(connection);
      untrusted_.remove(connection);
      rejected_.remove(connection);
    });
  }

  ConnectionServices& services_;
  std::string protocol_;
  Make make_;
  Listener listener_;
  ConnectionSlots<Connection> slots_, rejected_{most_rejected};
  ConnectionSlots<Connection> untrusted_{most_untrusted, Steady::duration{}, address_of_client};
  std::size_t running_ = 0;  // number of running coroutines of connections
};

}  // namespace sonar
