// Services that the TCP connections of control and of sonars' HTTP share: limits, admission, the token, the log.
#pragma once

#include <algorithm>
#include <chrono>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <string>
#include <tuple>

#include "daemon/config/config.hpp"
#include "daemon/emulator/world/world.hpp"
#include "daemon/server/connections/admission.hpp"
#include "daemon/server/connections/input_rate.hpp"
#include "daemon/server/connections/token.hpp"
#include "daemon/server/system/asio.hpp"
#include "daemon/server/system/log.hpp"

namespace sonar {

// A bounded set of connections of one listener. If all slots are in use, a new connection evicts one of the address with most
// connections: a connection without a request so far or, if there is none, the one that has been idle longest.

/// A Connection has `active_at` (steady time of the arrival or the last useful activity), `proved` (true after a whole request or
/// a pose) and close(), which makes its coroutines return.
template <class Connection>
class ConnectionSlots {
 public:
  using Pointer = std::shared_ptr<Connection>;
  using Silence = std::chrono::steady_clock::duration;

  using Owner = std::function<std::string(const Connection&)>;

  /// A connection with useful activity within `busy` is evicted only for an owner that has at least two connections fewer.
  explicit ConnectionSlots(std::size_t most, Silence busy = std::chrono::seconds(1), Owner owner = {})
      : most_(most), busy_(busy), owner_(std::move(owner)) {}
  /// Returns true if a slot is free for a connection of `owner`. If necessary, calls `evicted` with a connection and then evicts
  /// it.
  template <class Evicted>
  bool make_room(const std::string& owner, Evicted&& evicted) {
    return taken_.size() < most_ || evict(owner, std::forward<Evicted>(evicted));
  }
  /// Evicts a connection even if a slot is free. Returns false if there is none, or if all are busy.
  bool evict(const std::string& owner, auto&& evicted) {
    std::map<std::string, int> counts;
    if (owner_)
      for (const Pointer& c : taken_) ++counts[owner_(*c)];
    const auto count_of = [&](const std::string& of) { return counts.contains(of) ? counts.at(of) : 0; };
    const auto now = std::chrono::steady_clock::now();
    auto chosen = taken_.end();
    std::tuple<int, bool, std::chrono::steady_clock::time_point> least;
    for (auto it = taken_.begin(); it != taken_.end(); ++it) {
      const Connection& c = **it;
      const int of_owner = owner_ ? count_of(owner_(c)) : 0;
      const bool is_busy = c.proved && now - c.active_at < busy_;
      if (is_busy && of_owner <= count_of(owner) + 1) continue;
      const std::tuple rank(-of_owner, c.proved, c.active_at);
      if (chosen != taken_.end() && least <= rank) continue;
      chosen = it;
      least = rank;
    }
    if (chosen == taken_.end()) return false;
    evicted(**chosen);
    (*chosen)->close();
    taken_.erase(chosen);
    return true;
  }
  void add(const Pointer& connection) { taken_.push_back(connection); }
  void remove(const Pointer& connection) { taken_.remove(connection); }
  /// Frees the slots of these connections without closing them.
  void forget_if(auto&& is) {
    taken_.remove_if([&](const Pointer& c) { return is(*c); });
  }
  void close_all() {
    for (const Pointer& c : taken_) c->close();
  }
  std::size_t most() const { return most_; }

 private:
  std::size_t most_;
  Silence busy_;
  Owner owner_;
  std::list<Pointer> taken_;
};

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
