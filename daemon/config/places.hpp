// The connections of one listener, at most so many: when every place is taken, the connection that has been silent for longest
// gives up its own to a newcomer, unless all are busy. Where the connections have owners, it is one of the owner who has most.
#pragma once

#include <algorithm>
#include <chrono>
#include <functional>
#include <list>
#include <memory>
#include <string>
#include <tuple>

namespace sonar {

/// A Connection has a `heard_at` (steady clock) and a close(), after which its coroutines end by themselves.
template <class Connection>
class Places {
 public:
  using Pointer = std::shared_ptr<Connection>;
  using Silence = std::chrono::steady_clock::duration;

  using Owner = std::function<std::string(const Connection&)>;

  /// Newcomers do not push out those who were heard within `busy`.
  explicit Places(std::size_t most, Silence busy = std::chrono::seconds(1), Owner owner = {})
      : most_(most), busy_(busy), owner_(std::move(owner)) {}
  /// True when there is room for one more. `evicted` is told whom that costs its place.
  template <class Evicted>
  bool make_room(Evicted&& evicted) {
    if (taken_.size() < most_) return true;
    const auto longest = std::min_element(taken_.begin(), taken_.end(), [this](const Pointer& a, const Pointer& b) {
      return std::tuple(-places_of_owner(*a), a->heard_at) < std::tuple(-places_of_owner(*b), b->heard_at);
    });
    if (longest == taken_.end() || std::chrono::steady_clock::now() - (*longest)->heard_at < busy_) return false;
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
  std::ptrdiff_t places_of_owner(const Connection& connection) const {
    if (!owner_) return 0;
    return std::count_if(taken_.begin(), taken_.end(), [&](const Pointer& c) { return owner_(*c) == owner_(connection); });
  }

  std::size_t most_;
  Silence busy_;
  Owner owner_;
  std::list<Pointer> taken_;
};

}  // namespace sonar
