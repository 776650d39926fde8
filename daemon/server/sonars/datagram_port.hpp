// A UDP port of an emulated sonar: datagrams of hosts are answered (Port::Kind::udp_answer), also those sent to the broadcast
// address of its network, or belong to a dialogue (Port::Kind::udp_dialogue), and pings are sent from it. Owned by Device; the
// bytes are the vendor's.
#pragma once

#include <array>
#include <functional>
#include <list>
#include <vector>

#include "core/base/result.hpp"
#include "daemon/config/config.hpp"
#include "daemon/server/system/asio.hpp"

namespace sonar {

class DatagramPort {
 public:
  /// Returns the datagrams to send back.
  using Answer = std::function<std::vector<protocol::Bytes>(Endpoint from, protocol::BytesView datagram)>;

  explicit DatagramPort(asio::io_context& io) : io_(io) {}

  /// On the sonar's own address; port 0: any. `shared`: hosts on this computer may have the same port at all its addresses, as
  /// they may when the device is elsewhere. Errors name the address and the next step.
  Result<void> open(const SonarConfig& sonar, std::uint16_t port, bool shared);
  /// From start() on, what arrives is answered.
  void answer_with(Answer answer) { answer_ = std::move(answer); }
  /// A host whose port is closed is named when its computer says so, to what was sent there. Before start().
  void on_port_unreachable(std::function<void(Endpoint host)> tell) { closed_ = std::move(tell); }
  /// Receives broadcasts, too. An address that cannot be bound is left out.
  void receive_broadcasts(const SonarConfig& sonar);
  void start();
  void stop();
  /// Socket of the sonar's own address, to send from.
  udp::socket& socket() { return sockets_.front().socket; }
  std::uint16_t number() const { return number_; }

 private:
  struct Socket {
    explicit Socket(asio::io_context& io) : socket(io) {}
    udp::socket socket;
    udp::endpoint from;
    std::array<std::byte, 1500> datagram{};
  };
  void receive(Socket& at);
  void take_errors();

  asio::io_context& io_;
  Answer answer_;
  std::function<void(Endpoint host)> closed_;
  std::list<Socket> sockets_;
  std::uint16_t number_ = 0;  // as asked for
  bool stopping_ = false;
};

}  // namespace sonar
