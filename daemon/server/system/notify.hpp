// Informs a service manager (with systemd's sd_notify protocol, implemented here) that the daemon is ready, reloads, stops, or is
// alive. Without a manager the calls do nothing. App owns it, and only the I/O thread uses it.
//
// The daemon is alive if the I/O loop runs (a timer of that loop sends the message) and the simulation thread does not hang: the
// present ping has taken less than the watchdog's period. A daemon without clients, which computes no pings, is alive. A single
// failure (a refused ping, a client) is not a reason for a restart.
#pragma once

#include <chrono>
#include <functional>
#include <string>

#include "daemon/server/system/asio.hpp"
#include "daemon/server/system/log.hpp"

namespace sonar {

/// Address from a service manager's environment.
struct NotifyTarget {
  std::string socket;                     // a path, or @name in the abstract namespace; empty = no service manager
  std::chrono::microseconds watchdog{0};  // period; 0 = no watchdog
};
/// Reads NOTIFY_SOCKET, WATCHDOG_USEC and WATCHDOG_PID; ignores a watchdog for another process.
NotifyTarget notify_target_from_environment();

class Notify {
 public:
  /// `ping_under_way` returns the duration of the present ping so far; 0 = the simulation thread waits for work.
  Notify(asio::io_context& io, NotifyTarget target, std::function<std::chrono::nanoseconds()> ping_under_way, Log& log);
  ~Notify();
  Notify(const Notify&) = delete;
  Notify& operator=(const Notify&) = delete;

  /// Reports that the listeners are open, after the start or a reload. The first call starts the messages of the watchdog.
  void ready(const std::string& status);
  /// Reports that the configuration changes until the next ready().
  void reloading();
  /// Ends the watchdog's messages, so that the I/O loop may return.
  void stopping();

 private:
  void send(const std::string& message, int flags);
  void keep_alive();

  NotifyTarget target_;
  std::function<std::chrono::nanoseconds()> ping_under_way_;
  Log& log_;
  asio::steady_timer timer_;
  int socket_ = -1;  // stays open, so that a lack of descriptors never prevents a message
  bool stopping_ = false, keeping_ = false, complained_ = false, stuck_ = false;
};

}  // namespace sonar
