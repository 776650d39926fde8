// Listens for poses: protobuf datagrams, and JSON lines over UDP and TCP. App owns the server. (The control stream has its own
// server, daemon/server/control/.) Malformed messages are refused and counted, and logged at a limited rate; a connection that
// does not send JSON is closed. Connections are served in turns of bounded work, no faster than the limits allow. Beyond the
// limits only the newest pose is kept, so that no pose takes effect late.
#pragma once

#include <list>
#include <memory>
#include <span>
#include <string>

#include "core/base/result.hpp"
#include "daemon/config/config.hpp"
#include "daemon/server/connections/connection_services.hpp"
#include "daemon/server/connections/input_rate.hpp"
#include "daemon/server/connections/listener.hpp"
#include "daemon/server/connections/port_guard.hpp"
#include "daemon/server/poses/pose_intake.hpp"
#include "daemon/server/system/asio.hpp"
#include "daemon/server/system/log.hpp"
#include "protocol/control/json_pose.hpp"

namespace sonar {

class PoseServer {
 public:
  /// All arguments must outlive the server.
  PoseServer(asio::io_context& io, const PoseConfig& config, const LimitConfig& limits, Admission& admission, PoseIntake& intake,
             Log& log);

  Result<void> open();
  void start();
  void stop();

  /// Return the listening addresses, with the port that the system chose if 0 was configured. Port 0 = off.
  Endpoint protobuf() const { return protobuf_at_; }
  Endpoint json() const { return json_at_; }

 private:
  enum class Encoding { protobuf, json };
  static constexpr std::size_t most_datagrams_per_s = 8192;  // limit for all senders; simulators send up to a few thousand
  struct Port {
    Port(Encoding e, udp::socket s, asio::io_context& io, Admission& admission)
        : encoding(e), datagrams(std::move(s)), lines(io, admission, Admission::Purpose::client) {}
    Encoding encoding;
    udp::socket datagrams;
    DatagramRate rate{most_datagrams_per_s};
    Listener lines;  // TCP listener, for JSON only
  };
  /// The connection of a TCP sender. It is closed by stop(), or if its slot is needed and no other sender has been idle or over
  /// its limits for longer. A sender that has disconnected has no slot.
  struct Connection {
    Connection(tcp::socket s, Sender from, std::size_t bytes_per_s, SharedRate::Part part)
        : socket(std::move(s)),
          sender(std::move(from)),
          turn(socket.get_executor()),
          rate(bytes_per_s),
          of_all(std::move(part)) {}
    tcp::socket socket;
    Sender sender;
    asio::steady_timer turn;  // expires when the next lines of this connection are processed
    InputRate rate;
    SharedRate::Part of_all;
    control::LineParser lines;
    int not_json = 0;  // number of lines in succession that are not JSON
    std::chrono::steady_clock::time_point active_at =
        std::chrono::steady_clock::now();                          // time of its last pose within the limits
    std::chrono::steady_clock::time_point kept_up_at = active_at;  // last time at which little or nothing waited in the kernel
    std::chrono::steady_clock::time_point behind_until{};
    bool proved = false;  // true: the last pose was within the limits
    void close() {
      error_code ec;
      socket.close(ec);
      turn.cancel();
    }
  };
  using ConnectionPointer = std::shared_ptr<Connection>;

  Result<Endpoint> open(Port& port, Endpoint at);
  void log_fault(const std::string& fault, const std::string& at);
  asio::awaitable<void> receive(Port& port);
  asio::awaitable<void> read_lines(ConnectionPointer connection);
  enum class Turn { over, not_over, end };  // over: no whole line remains; end: the connection does not send JSON
  struct Work {
    std::size_t bytes = 0;
    bool has_pose = false;  // true: a pose was accepted
  };
  Turn take_turn(Connection& connection, Work& work);
  enum class Rested { goes_on, leaves_much };  // leaves_much: the sender disconnected after sending more than the limits allow
  asio::awaitable<Rested> rest(Connection& connection, const Work& work);
  void take_newest(Connection& connection);
  bool drop_backlog(Connection& connection, bool pauses);
  void admit(tcp::socket socket);

  static std::size_t work_of(Encoding encoding, std::span<const std::byte> datagram);
  void on_datagram(Encoding encoding, std::span<const std::byte> bytes, const udp::endpoint& from);
  enum class LineKind { pose, other_object, not_json };  // an accepted pose; another JSON object; neither
  LineKind on_line(const control::LineParser::Line& line, const Sender& sender);

  asio::io_context& io_;
  const PoseConfig& config_;
  const LimitConfig& limits_;
  Admission& admission_;
  PoseIntake& intake_;
  Log& log_;
  LogLimiter notices_, faults_;
  std::list<Port> ports_;
  ConnectionSlots<Connection> connections_;
  WorkRate of_address_;  // limit for the datagrams of one address
  SharedRate together_;  // limit for all connections together
  InputRate dropping_;   // limit for bytes of all connections that are read and dropped
  Endpoint protobuf_at_, json_at_;
  bool stopping_ = false;
};

}  // namespace sonar
