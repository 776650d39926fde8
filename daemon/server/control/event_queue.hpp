// The events queued for one subscriber: only the kinds it subscribed to, at most `deepest`. Events dropped for a slow subscriber
// are counted; the count is sent with the next event.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <utility>
#include <variant>

#include "protocol/control/operations.hpp"

namespace sonar {

class EventQueue {
 public:
  static constexpr std::size_t deepest = 64;

  void subscribe(const control::Subscribe& wanted) { wanted_ = wanted; }
  bool subscribes_any() const { return wanted_.pings || wanted_.clients || wanted_.poses || wanted_.scene; }

  /// True when it was queued.
  bool offer(const control::Event& event) {
    if (!subscribes_to(event)) return false;
    if (waiting_.size() == deepest) {
      ++unsent_;
      return false;
    }
    waiting_.push_back(event);
    waiting_.back().unsent = std::exchange(unsent_, 0);
    return true;
  }
  std::optional<control::Event> next() {
    if (waiting_.empty()) return std::nullopt;
    std::optional<control::Event> event(std::move(waiting_.front()));
    waiting_.pop_front();
    return event;
  }
  bool empty() const { return waiting_.empty(); }

 private:
  bool subscribes_to(const control::Event& event) const {
    const bool by_kind[] = {wanted_.pings, wanted_.clients, wanted_.poses, wanted_.scene};
    static_assert(std::variant_size_v<decltype(control::Event::what)> == 4);
    return by_kind[event.what.index()];
  }
  control::Subscribe wanted_;
  std::deque<control::Event> waiting_;
  std::uint64_t unsent_ = 0;
};

}  // namespace sonar
