// Answers the datagrams by which hosts look for a sonar (protocol::Port::Kind::udp_answer): on the sonar's own address and on the
// broadcast address of its network. Owned by Device; what is said is the vendor's.
#pragma once

#include <array>
#include <functional>
#include <list>

#include "core/base/result.hpp"
#include "daemon/config/config.hpp"
#include "daemon/server/system/asio.hpp"

namespace sonar {

class DatagramAnswers {
 public:
  using Answer = std::function<protocol::Bytes(protocol::BytesView datagram)>;

  /// `answer` gives the bytes to send back, or none.
  DatagramAnswers(asio::io_context& io, Answer answer) : io_(io), answer_(std::move(answer)) {}

  /// Errors name the address and the next step. A broadcast address that cannot be had is done without.
  Result<void> open(const SonarConfig& sonar, std::uint16_t port);
  void start();
  void stop();

 private:
  struct Place {
    explicit Place(asio::io_context& io) : socket(io) {}
    udp::socket socket;
    udp::endpoint from;
    std::array<std::byte, 512> datagram{};
  };
  void receive(Place& place);

  asio::io_context& io_;
  Answer answer_;
  std::list<Place> places_;
  bool stopping_ = false;
};

}  // namespace sonar
