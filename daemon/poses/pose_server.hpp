// Listens for poses: protobuf datagrams, and JSON lines by UDP and TCP. Owned by App; the control stream is a server of its own
// (daemon/control/). A malformed message costs its sender a counted refusal and, now and then, a log line; never more.
#pragma once

#include <list>
#include <memory>
#include <span>
#include <string>

#include "core/base/result.hpp"
#include "daemon/config/config.hpp"
#include "daemon/config/places.hpp"
#include "daemon/poses/pose_intake.hpp"
#include "daemon/system/asio.hpp"
#include "daemon/system/log.hpp"

namespace sonar {

class PoseServer {
 public:
  PoseServer(asio::io_context& io, const PoseConfig& config, PoseIntake& intake, Log& log);

  Result<void> open();
  void start();
  void stop();

  /// Where it listens, with the ports the system chose for 0. Port 0 = off.
  Endpoint protobuf() const { return protobuf_at_; }
  Endpoint json() const { return json_at_; }

 private:
  enum class Encoding { protobuf, json };
  struct Listener {
    Encoding encoding;
    udp::socket datagrams;
    tcp::acceptor acceptor;  // of JSON lines only
  };
  /// One TCP sender; closed by stop(), or when its place is needed and it has been silent for longest.
  struct Connection {
    tcp::socket socket;
    Sender sender;
    std::chrono::steady_clock::time_point heard_at = std::chrono::steady_clock::now();
    void close() {
      error_code ec;
      socket.close(ec);
    }
  };
  using ConnectionPointer = std::shared_ptr<Connection>;

  Result<Endpoint> open(Listener& listener, Endpoint at);
  void keep_receiving(Listener& listener);
  void keep_accepting(Listener& listener);
  void say_fault(const std::exception_ptr& fault, const std::string& at);
  asio::awaitable<void> receive(Listener& listener);
  asio::awaitable<void> accept(Listener& listener);
  asio::awaitable<void> read_lines(ConnectionPointer connection);
  void admit(tcp::socket socket);

  void on_datagram(Encoding encoding, std::span<const std::byte> bytes, const udp::endpoint& from);
  void on_line(const std::string& text, const Sender& sender);

  asio::io_context& io_;
  const PoseConfig& config_;
  PoseIntake& intake_;
  Log& log_;
  LogLimiter notices_, faults_;
  std::list<Listener> listeners_;
  Places<Connection> connections_;
  Endpoint protobuf_at_, json_at_;
  bool stopping_ = false;
};

}  // namespace sonar
