// A UDP port of an emulated sonar. It answers the datagrams of hosts, including broadcasts (Port::Kind::udp_answer), or passes
// them to a dialogue (Port::Kind::udp_dialogue). Pings are also sent from this port. Device owns it.
#pragma once

#include <array>
#include <functional>
#include <list>
#include <optional>
#include <vector>

#include "core/base/result.hpp"
#include "daemon/config/config.hpp"
#include "daemon/server/connections/port_guard.hpp"
#include "daemon/server/system/asio.hpp"

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
  DatagramRate rate_{most_per_s};
  std::uint16_t number_ = 0;  // the requested port number
  bool stopping_ = false;
};

}  // namespace sonar
