// How many clients may be connected at a time, over all sonars, and what happens when file descriptors run out.
// Owned by App, asked by every listener for each socket it accepts. I/O thread only.
//
// The last descriptors below the process's limit are never given to clients: whatever else the daemon needs one for (a log, a
// scene) finds one. Of these, half are for control alone, so that the cause can be asked for. Some before them are for drivers:
// pose senders and control get one of these only in exchange for a connection of their own. If descriptors run out nevertheless,
// one in reserve is used to accept connections and close them; without it they would stay in the listener's queue, which would
// report them again and again.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>

#include "daemon/config/config.hpp"
#include "daemon/server/system/asio.hpp"
#include "daemon/server/system/log.hpp"

namespace sonar {

/// Raises the soft limit of open file descriptors to the hard one.
void raise_descriptor_limit();

class Admission {
 public:
  /// Held by whatever holds the socket; the place is free when the last copy is gone. Empty = there is none.
  using Place = std::shared_ptr<const void>;

  Admission(const LimitConfig& limits, Log& log);
  ~Admission();
  Admission(const Admission&) = delete;
  Admission& operator=(const Admission&) = delete;

  enum class Purpose { client, control };

  /// Gives a slot to a socket that was just accepted. If the slot is empty, close the socket; the first refusal of a series is
  /// logged.
  Place enter(const tcp::socket& socket);
  /// Whether a socket of another kind has one of the descriptors for drivers, or one beyond. A connection of the same listener
  /// must then be closed for it.
  bool is_drivers(const tcp::socket& socket) const;
  /// Accepts the next connection of a listener, whatever its descriptor. nullopt: the listener is closed.
  asio::awaitable<std::optional<tcp::socket>> accept(tcp::acceptor& acceptor);
  /// Accepts the next connection of a listener without slots here, with a descriptor outside the reserve. nullopt: as accept().
  asio::awaitable<std::optional<tcp::socket>> next_visitor(tcp::acceptor& acceptor, Purpose purpose);

  /// Connected now: clients, waiting ones and those being refused.
  std::uint64_t now() const { return *count_; }
  std::uint64_t refused_for_places() const { return for_places_; }
  std::uint64_t refused_for_descriptors() const { return for_descriptors_; }

 private:
  using Steady = std::chrono::steady_clock;
  void say(Steady::time_point& last, const char* what);
  /// False: the descriptor is one of the spare ones; the log has a line.
  bool leaves_spare(const tcp::socket& socket, Purpose purpose);
  /// accept() failed with `why`. True when that was for want of descriptors and the visitor has been sent away: accept again.
  bool send_away(tcp::acceptor& acceptor, const error_code& why);

  const LimitConfig& limits_;
  Log& log_;
  std::shared_ptr<std::uint64_t> count_ = std::make_shared<std::uint64_t>(0);  // places outlive us where sessions do
  std::uint64_t for_places_ = 0, for_descriptors_ = 0;
  Steady::time_point places_said_{}, descriptors_said_{};
  int reserve_ = -1;
};

/// FIN, if need be over what the visitor has sent already: with that unread the kernel would answer RST.
void close_politely(tcp::socket& socket);

}  // namespace sonar
