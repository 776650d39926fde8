// A UDP port of an emulated sonar. It answers the datagrams of hosts, including broadcasts (Port::Kind::udp_answer), or passes
// them to a dialogue (Port::Kind::udp_dialogue). Pings are also sent from this port. Device owns it.
#pragma once

#include <algorithm>
#include <array>
#include <chrono>
#include <functional>
#include <list>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/base/result.hpp"
#include "daemon/config/config.hpp"
#include "daemon/server/connections/port_guard.hpp"
#include "daemon/server/sonars/session.hpp"
#include "daemon/server/system/asio.hpp"
#include "daemon/server/system/log.hpp"

namespace sonar {

class DatagramPort {
 public:
  /// Returns the datagrams to send back; nullopt: the datagram was dropped because of the limits.
  using Answer = std::function<std::optional<std::vector<protocol::Bytes>>(Endpoint from, protocol::BytesView datagram)>;

  explicit DatagramPort(asio::io_context& io) : io_(io) {}

  /// Binds the port at the sonar's own address; port 0: any free port. `shared`: host programs on this computer may bind the same
  /// port at all addresses, as they can with a real device. Errors name the address and the next step.
  Result<void> open(const SonarConfig& sonar, std::uint16_t port, bool shared);
  /// Sets the function that answers datagrams. Call this before start().
  void answer_with(Answer answer) { answer_ = std::move(answer); }
  /// Sets the function that is called with the address of a host if the host's computer answers a datagram with "port
  /// unreachable" (ICMP). Call this before start().
  void on_port_unreachable(std::function<void(Endpoint host)> tell) { closed_ = std::move(tell); }
  /// Also receives broadcasts. Addresses that cannot be bound are ignored.
  void receive_broadcasts(const SonarConfig& sonar);
  void start();
  void stop();
  /// Returns the socket of the sonar's own address, for sending.
  udp::socket& socket() { return sockets_.front().socket; }
  std::uint16_t number() const { return number_; }

 private:
  struct Socket {
    explicit Socket(asio::io_context& io) : socket(io), pause(io) {}
    udp::socket socket;
    asio::steady_timer pause;
    udp::endpoint from;
    std::array<std::byte, 1500> datagram{};
  };
  static constexpr std::size_t most_per_s = 2048;  // limit of datagrams; hosts request a few dozen pings per second

  void receive(Socket& at);
  bool take(Socket& at, std::size_t size);
  void take_errors();

  asio::io_context& io_;
  Answer answer_;
  std::function<void(Endpoint host)> closed_;
  std::list<Socket> sockets_;
  udp::endpoint broadcast_;  // port 0: broadcasts are not received
  DatagramRate rate_{most_per_s};
  std::uint16_t number_ = 0;  // the requested port number
  bool stopping_ = false;
};

// Sends the status broadcast of an emulated sonar (Port::Kind::udp_beacon) periodically from a separate port. Device owns it.

class Beacon {
 public:
  /// `make` returns the present datagrams, in order; `fault` is called with the text of an exception. `log` must outlive the
  /// beacon.
  Beacon(asio::io_context& io, Log& log, std::string sonar, std::function<std::vector<protocol::Bytes>()> make,
         std::function<void(const std::string&)> fault)
      : log_(log), sonar_(std::move(sonar)), make_(std::move(make)), fault_(std::move(fault)), socket_(io), timer_(io) {}

  Result<void> open(const SonarConfig& sonar, const protocol::Port& port);
  void start();
  /// Sends without waiting for the period to pass, but not more often than every `shortest_pause`.
  void send_now() { timer_.expires_at(std::max(std::chrono::steady_clock::now(), sent_at_ + shortest_pause)); }
  void stop();
  const std::vector<udp::endpoint>& destinations() const { return to_; }

 private:
  static constexpr std::chrono::milliseconds shortest_pause{50};
  asio::awaitable<void> send();

  Log& log_;
  std::string sonar_;
  std::function<std::vector<protocol::Bytes>()> make_;
  std::function<void(const std::string&)> fault_;
  udp::socket socket_;
  asio::steady_timer timer_;
  std::chrono::milliseconds period_{0};
  std::chrono::steady_clock::time_point sent_at_{};
  std::vector<udp::endpoint> to_;
  bool stopping_ = false, failed_ = false;
};

// Sends the messages of an emulated sonar as datagrams: to all receivers of a port of kind udp_stream, or to the host of a port
// of kind udp_dialogue. It sends whole messages in order, and pauses between the datagrams of a message. The Device and the
// coroutine own it.

class DatagramStream : public std::enable_shared_from_this<DatagramStream> {
 public:
  /// `socket` and `parent` must outlive the stream. `gap`: shortest time between two datagrams of a message.
  DatagramStream(SessionParent& parent, udp::socket& socket, ConnectionId id, std::chrono::nanoseconds gap)
      : parent_(parent), socket_(socket), id_(id), gap_(gap), wake_(socket.get_executor()), pause_(socket.get_executor()) {}

  void start();
  /// Call it when there is a message to send.
  void wake() { wake_.cancel(); }
  /// Ends the stream after the current ping, or at once when the socket is closed.
  void finish(std::string why, bool by_host = false);
  /// Sends an empty datagram.
  void send_nothing_to(const Endpoint& to);
  /// Call it when a request of the host, or another sign of life, has arrived.
  void heard() {
    heard_at_ = std::chrono::steady_clock::now();
    looks_ = 0;
    wake_.cancel();  // the request may have changed the limit of silence
  }
  std::chrono::nanoseconds connected_for() const { return std::chrono::steady_clock::now() - began_at_; }
  std::chrono::nanoseconds silent_for() const { return std::chrono::steady_clock::now() - heard_at_; }
  ConnectionId id() const { return id_; }

 private:
  asio::awaitable<void> send();
  asio::awaitable<void> wait();
  asio::awaitable<bool> send_message(const Outbox::Message& message, std::vector<Endpoint> receivers);
  asio::awaitable<bool> send_datagram(const protocol::Bytes& datagram, const std::vector<Endpoint>& receivers);

  SessionParent& parent_;
  udp::socket& socket_;
  ConnectionId id_;
  std::chrono::nanoseconds gap_;
  asio::steady_timer wake_, pause_;
  std::chrono::steady_clock::time_point began_at_ = std::chrono::steady_clock::now(), heard_at_ = began_at_, looked_at_;
  int looks_ = 0;  // number of probes of the silent host since heard_at_
  bool finishing_ = false, by_host_ = false;
  std::string why_;
};

}  // namespace sonar
