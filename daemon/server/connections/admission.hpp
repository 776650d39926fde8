// Limits the number of connected clients of all sonars, and handles a shortage of file descriptors. App owns the only Admission;
// every listener calls it for each accepted socket, in the I/O thread.
//
// The highest descriptor numbers of the process are not used for clients of sonars, so that the daemon can always open a log or a
// scene; half of these numbers are only for control, so that users can query the cause. Some lower numbers are for drivers: pose
// senders and control get such a number only if one of their own connections is closed. If descriptors run out nevertheless, a
// reserved one is used to accept and close connections, which would otherwise stay in the listener's queue and wake the listener
// repeatedly.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>

#include "daemon/config/config.hpp"
#include "daemon/server/connections/port_guard.hpp"
#include "daemon/server/system/asio.hpp"
#include "daemon/server/system/log.hpp"

namespace sonar {

/// Raises the soft limit of open file descriptors to the hard limit.
void raise_descriptor_limit();

class Admission {
 public:
  /// The slot of a client. The owner of the socket holds it; the slot becomes free when the last copy is destroyed. Empty if no
  /// slot is free.
  using Place = std::shared_ptr<const void>;

  Admission(const LimitConfig& limits, Log& log);
  ~Admission();
  Admission(const Admission&) = delete;
  Admission& operator=(const Admission&) = delete;

  enum class Purpose { client, control };

  /// Requests a slot for a socket that was just accepted. If the result is empty, close the socket; the first refusal of a
  /// series is logged.
  Place enter(const tcp::socket& socket);
  /// True if the descriptor of a socket that is not from a driver is reserved for drivers, or higher. Another connection of the
  /// same listener must then be closed.
  bool is_drivers(const tcp::socket& socket) const;
  /// Accepts the next connection of a listener, with any descriptor. nullopt: the listener is closed.
  asio::awaitable<std::optional<tcp::socket>> accept(tcp::acceptor& acceptor);
  /// Accepts the next connection of a listener that has no slots here, with a descriptor outside the reserve. nullopt: the
  /// listener is closed.
  asio::awaitable<std::optional<tcp::socket>> next_visitor(tcp::acceptor& acceptor, Purpose purpose);

  /// Returns the limits per address at the ports of all sonars.
  PortGuard& guard() { return guard_; }

  /// Returns the number of clients: connected, waiting and being refused.
  std::uint64_t now() const { return *count_; }
  std::uint64_t refused_for_places() const { return for_places_; }
  std::uint64_t refused_for_descriptors() const { return for_descriptors_; }

 private:
  using Steady = std::chrono::steady_clock;
  void log_first(Steady::time_point& last, const char* what);
  /// Returns false, and logs a line, if the descriptor is a reserved one.
  bool leaves_spare(const tcp::socket& socket, Purpose purpose);
  /// Call it when accept() failed with `why`. Returns true if descriptors had run out, and a waiting client was accepted and
  /// closed; then call accept() again.
  bool send_away(tcp::acceptor& acceptor, const error_code& why);

  const LimitConfig& limits_;
  Log& log_;
  PortGuard guard_;
  std::shared_ptr<std::uint64_t> count_ =
      std::make_shared<std::uint64_t>(0);  // shared, because slots of sessions may outlive this object
  std::uint64_t for_places_ = 0, for_descriptors_ = 0;
  Steady::time_point slots_logged_{}, descriptors_logged_{};
  int reserve_ = -1;
};

/// Closes with FIN. First reads the received bytes, because with unread bytes the kernel would send RST.
void close_politely(tcp::socket& socket);
/// Closes with RST; unsent bytes are lost.
void close_by_reset(tcp::socket& socket);

}  // namespace sonar
