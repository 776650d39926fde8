// A bounded set of connections of one listener. When all slots are taken, a new connection evicts the longest idle one, unless
// all are busy. Where connections have owners, it evicts one of the owner with most connections.
#pragma once

#include <algorithm>
#include <chrono>
#include <functional>
#include <list>
#include <memory>
#include <string>
#include <tuple>

namespace sonar {

/// A Connection has `active_at` (steady clock) and close(), after which its coroutines return.
template <class Connection>
class ConnectionSlots {
 public:
  using Pointer = std::shared_ptr<Connection>;
  using Silence = std::chrono::steady_clock::duration;

  using Owner = std::function<std::string(const Connection&)>;

  /// Connections active within `busy` are not evicted.
  explicit ConnectionSlots(std::size_t most, Silence busy = std::chrono::seconds(1), Owner owner = {})
      : most_(most), busy_(busy), owner_(std::move(owner)) {}
  /// True when a slot is free; evicts a connection if necessary, and calls `evicted` with it first.
  template <class Evicted>
  bool make_room(Evicted&& evicted) {
    if (taken_.size() < most_) return true;
    const auto longest = std::min_element(taken_.begin(), taken_.end(), [this](const Pointer& a, const Pointer& b) {
      return std::tuple(-slots_of_owner(*a), a->active_at) < std::tuple(-slots_of_owner(*b), b->active_at);
    });
    if (longest == taken_.end() || std::chrono::steady_clock::now() - (*longest)->active_at < busy_) return false;
    evicted(**longest);
    (*longest)->close();
    taken_.erase(longest);
    return true;
  }
  void add(const Pointer& connection) { taken_.push_back(connection); }
  void remove(const Pointer& connection) { taken_.remove(connection); }
  void close_all() {
    for (const Pointer& c : taken_) c->close();
  }
  std::size_t most() const { return most_; }

 private:
  std::ptrdiff_t slots_of_owner(const Connection& connection) const {
    if (!owner_) return 0;
    return std::count_if(taken_.begin(), taken_.end(), [&](const Pointer& c) { return owner_(*c) == owner_(connection); });
  }

  std::size_t most_;
  Silence busy_;
  Owner owner_;
  std::list<Pointer> taken_;
};

}  // namespace sonar
