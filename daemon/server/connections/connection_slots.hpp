// A bounded set of connections of one listener. When all slots are taken, a new connection evicts another: one of the address
// with most connections, first one that has asked for nothing yet, then the longest idle.
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

/// A Connection has `active_at` (steady clock: when it came, or when it was last of use), `proved` (it has been of use: a whole
/// request, a pose) and close(), after which its coroutines return.
template <class Connection>
class ConnectionSlots {
 public:
  using Pointer = std::shared_ptr<Connection>;
  using Silence = std::chrono::steady_clock::duration;

  using Owner = std::function<std::string(const Connection&)>;

  /// A connection that was of use within `busy` is evicted only for an owner that has fewer.
  explicit ConnectionSlots(std::size_t most, Silence busy = std::chrono::seconds(1), Owner owner = {})
      : most_(most), busy_(busy), owner_(std::move(owner)) {}
  /// True when a slot is free for a connection of `owner`; evicts a connection if necessary, and calls `evicted` with it first.
  template <class Evicted>
  bool make_room(const std::string& owner, Evicted&& evicted) {
    return taken_.size() < most_ || evict(owner, std::forward<Evicted>(evicted));
  }
  /// Evicts a connection whether or not a slot is free. False: all are busy, or there is none.
  template <class Evicted>
  bool evict(const std::string& owner, Evicted&& evicted) {
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
  /// Their slots are free; they are not closed.
  template <class Is>
  void forget_if(Is&& is) {
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
