// Services that the TCP connections of control and of sonars' HTTP share: limits, admission, the token, the log.
#pragma once

#include <chrono>
#include <memory>
#include <string>

#include "daemon/config/config.hpp"
#include "daemon/emulator/world/world.hpp"
#include "daemon/server/connections/admission.hpp"
#include "daemon/server/connections/input_rate.hpp"
#include "daemon/server/connections/token.hpp"
#include "daemon/server/system/asio.hpp"
#include "daemon/server/system/log.hpp"

namespace sonar {

/// Services of one server. They must outlive its connections.
struct ConnectionServices {
  asio::io_context& io;
  const LimitConfig& limits;
  Admission& admission;
  Log& log;
  std::string server;  // name in the log: "control" or "sonar NAME"
  Admission::Purpose purpose = Admission::Purpose::control;
  Token token = {};  // without a token every client is trusted
  LogLimiter refusals = {}, notices = {}, faults = {};
  WorkRate work = {};

  /// Returns the time that a client must wait after this much work.
  WorkRate::Steady::duration pause_after(const Sender& of, std::size_t amount);
};

inline constexpr std::chrono::seconds greeting_limit{10};    // limit for the Hello, or to complete an HTTP request
inline constexpr std::chrono::seconds keep_alive_limit{60};  // limit between two HTTP requests
inline constexpr std::chrono::minutes operation_limit{5};    // time for which HTTP waits for a scene to load

/// Logs a refusal at a limited rate, because any client can cause it.
void log_refusal(ConnectionServices& services, const std::string& why, const std::string& from);
void log_fault(ConnectionServices& services, const std::string& fault, const std::string& at);

/// Closes a socket after a time limit. A new limit replaces the previous one.
class Deadline : public std::enable_shared_from_this<Deadline> {
 public:
  using Steady = std::chrono::steady_clock;
  explicit Deadline(tcp::socket& socket) : socket_(socket), timer_(socket.get_executor()) {}
  void within(Steady::duration limit) {
    timer_.expires_after(limit);
    timer_.async_wait([weak = weak_from_this()](const error_code& ec) {
      const auto self = weak.lock();
      if (!self || ec || self->timer_.expiry() > Steady::now()) return;
      self->passed_ = true;
      error_code ignored;
      self->socket_.close(ignored);
    });
  }
  void none() { timer_.expires_at(Steady::time_point::max()); }  // cancels the limit
  bool passed() const { return passed_; }

 private:
  tcp::socket& socket_;  // socket of the connection that owns this object
  asio::steady_timer timer_;
  bool passed_ = false;
};

/// Writes all bytes, which must stay valid meanwhile. Returns false if the client closed the connection, or read no byte for
/// limits.stall.
asio::awaitable<bool> write_whole(ConnectionServices& services, tcp::socket& socket, Deadline& stall, const Sender& to,
                                  asio::const_buffer bytes);

}  // namespace sonar
