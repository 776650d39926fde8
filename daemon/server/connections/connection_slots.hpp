// A bounded set of connections of one listener. If all slots are in use, a new connection evicts one of the address with most
// connections: a connection without a request so far or, if there is none, the one that has been idle longest.
#pragma once

#include <algorithm>
#include <chrono>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <string>
#include <tuple>

namespace sonar {

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

}  // namespace sonar
