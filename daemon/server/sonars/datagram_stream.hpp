// Sends the messages of an emulated sonar as datagrams: to all receivers of a port of kind udp_stream, or to the host of a port
// of kind udp_dialogue. It sends whole messages in order, and pauses between the datagrams of a message. The Device and the
// coroutine own it.
#pragma once

#include <chrono>
#include <memory>
#include <string>

#include "daemon/server/sonars/session.hpp"

namespace sonar {

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
