// Sends the pings of an emulated sonar as datagrams to all receivers of a port of kind udp_stream, whole pings in order, and no
// faster than the port allows. Owned by its Device and by its own coroutine.
#pragma once

#include <chrono>
#include <memory>
#include <string>

#include "daemon/server/sonars/session.hpp"

namespace sonar {

class DatagramStream : public std::enable_shared_from_this<DatagramStream> {
 public:
  /// `socket` and `parent` outlive it. `gap`: least time between two datagrams of a ping.
  DatagramStream(SessionParent& parent, udp::socket& socket, ConnectionId id, std::chrono::nanoseconds gap)
      : parent_(parent), socket_(socket), id_(id), gap_(gap), wake_(socket.get_executor()), pause_(socket.get_executor()) {}

  void start();
  /// There is something to send.
  void wake() { wake_.cancel(); }
  /// No more pings after the one being sent, and no more of that when the socket is closed.
  void finish(std::string why);
  ConnectionId id() const { return id_; }

 private:
  asio::awaitable<void> send();
  asio::awaitable<bool> send_ping(const Outbox::Message& ping, const std::vector<Endpoint>& receivers);

  SessionParent& parent_;
  udp::socket& socket_;
  ConnectionId id_;
  std::chrono::nanoseconds gap_;
  asio::steady_timer wake_, pause_;
  bool finishing_ = false;
  std::string why_;
};

}  // namespace sonar
