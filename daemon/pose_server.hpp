// Listens for poses: protobuf and JSON lines, each by UDP and TCP, and hands them to the World.
// Owned by App. A malformed message costs its sender a counted refusal and, now and then, a log line; never more.
#pragma once

#include <functional>
#include <list>
#include <memory>
#include <string>
#include <vector>

#include "core/base/result.hpp"
#include "daemon/asio.hpp"
#include "daemon/clock.hpp"
#include "daemon/config.hpp"
#include "daemon/log.hpp"
#include "daemon/world.hpp"
#include "protocol/control/control.hpp"

namespace sonar {

class PoseServer {
 public:
  PoseServer(asio::io_context& io, const PoseConfig& config, World& world, const Clock& clock, Log& log,
             std::function<void()> on_pose);

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
    tcp::acceptor acceptor;
  };
  using Steady = std::chrono::steady_clock;
  /// One TCP sender; closed by stop(), or when its place is needed and it has been silent for longest.
  struct Connection {
    tcp::socket socket;
    Sender sender;
    Steady::time_point heard_at = Steady::now();
    bool greeted = false;
  };
  using ConnectionPointer = std::shared_ptr<Connection>;

  Result<Endpoint> open(Listener& listener, Endpoint at);
  bool allowed(const asio::ip::address& from);
  bool make_place();
  void keep_receiving(Listener& listener);
  void keep_accepting(Listener& listener);
  void say_fault(const std::exception_ptr& fault, const std::string& at);
  asio::awaitable<void> receive(Listener& listener);
  asio::awaitable<void> accept(Listener& listener);
  asio::awaitable<void> read_lines(ConnectionPointer connection);
  asio::awaitable<void> read_requests(ConnectionPointer connection);
  asio::awaitable<bool> answer(ConnectionPointer connection, control::Bytes message);
  control::Response respond(Connection& connection, control::BytesView message, bool& close);

  void on_datagram(Encoding encoding, std::span<const std::byte> bytes, const udp::endpoint& from);
  void on_line(const std::string& text, const Sender& sender);
  /// The refusal's sentence, or empty.
  std::string take(control::PoseSample sample, const Sender& sender);
  void map_wall(control::Stamp& stamp);
  void refuse(const std::string& why, const Sender& sender);
  void say_refusal(const std::string& why, const Sender& sender);

  asio::io_context& io_;
  const PoseConfig& config_;
  World& world_;
  const Clock& clock_;
  Log& log_;
  std::function<void()> on_pose_;
  LogLimiter refusals_, notices_, faults_;
  std::list<Listener> listeners_;
  std::list<ConnectionPointer> connections_;
  Endpoint protobuf_at_, json_at_;
  std::chrono::nanoseconds wall_shift_{0};  // our time = WALL stamp + shift
  bool stopping_ = false;
};

}  // namespace sonar
