// Limits the number of connected clients of all sonars, and handles a shortage of file descriptors. App owns it; every listener
// calls it for each socket that it accepts. I/O thread only.
//
// The last descriptors below the limit of the process are not for clients of sonars, so that the daemon can always open a log or
// a scene. Half of them are for control only, so that users can query the cause. Some descriptors before them are for drivers:
// pose senders and control get one of these only if one of their connections is closed for it. If descriptors run out
// nevertheless, a reserved one is used to accept connections and close them. Otherwise they would stay in the queue of the
// listener, which would report them again and again.
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

/// Raises the soft limit of open file descriptors to the hard one.
void raise_descriptor_limit();

class Admission {
 public:
  /// The slot of a client. The owner of the socket holds it; it is free when the last copy is destroyed. Empty = no slot.
  using Place = std::shared_ptr<const void>;

  Admission(const LimitConfig& limits, Log& log);
  ~Admission();
  Admission(const Admission&) = delete;
  Admission& operator=(const Admission&) = delete;

  enum class Purpose { client, control };

  /// Gives a slot to a socket that was just accepted. If the slot is empty, close the socket; the first refusal of a series is
  /// logged.
  Place enter(const tcp::socket& socket);
  /// Returns whether the socket, which is not a driver's, has one of the descriptors for drivers or one beyond. A connection of
  /// the same listener must then be closed for it.
  bool is_drivers(const tcp::socket& socket) const;
  /// Accepts the next connection of a listener, whatever its descriptor. nullopt: the listener is closed.
  asio::awaitable<std::optional<tcp::socket>> accept(tcp::acceptor& acceptor);
  /// Accepts the next connection of a listener without slots here, with a descriptor outside the reserve. nullopt: as accept().
  asio::awaitable<std::optional<tcp::socket>> next_visitor(tcp::acceptor& acceptor, Purpose purpose);

  /// Limits of addresses at the ports of all sonars.
  PortGuard& guard() { return guard_; }

  /// The number of clients: connected, waiting and being refused.
  std::uint64_t now() const { return *count_; }
  std::uint64_t refused_for_places() const { return for_places_; }
  std::uint64_t refused_for_descriptors() const { return for_descriptors_; }

 private:
  using Steady = std::chrono::steady_clock;
  void say(Steady::time_point& last, const char* what);
  /// Returns false, and logs a line, if the descriptor is one of the spare ones.
  bool leaves_spare(const tcp::socket& socket, Purpose purpose);
  /// Call it when accept() failed with `why`. Returns true if descriptors had run out and one waiting client was closed: accept
  /// again.
  bool send_away(tcp::acceptor& acceptor, const error_code& why);

  const LimitConfig& limits_;
  Log& log_;
  PortGuard guard_;
  std::shared_ptr<std::uint64_t> count_ =
      std::make_shared<std::uint64_t>(0);  // shared, because places of sessions may outlive this object
  std::uint64_t for_places_ = 0, for_descriptors_ = 0;
  Steady::time_point places_said_{}, descriptors_said_{};
  int reserve_ = -1;
};

/// Closes with FIN. Reads what the client has sent before, because with unread bytes the kernel would send RST.
void close_politely(tcp::socket& socket);
/// Closes with RST, whatever was not sent.
void close_by_reset(tcp::socket& socket);

}  // namespace sonar
