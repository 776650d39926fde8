// Measures the rate of a sonar's pings, because no setting states the rate if the host requests each ping.
#pragma once

#include <algorithm>
#include <chrono>
#include <deque>

#include "core/base/units.hpp"

namespace sonar {

class RecentRate {
 public:
  void add(Time fired) {
    if (!fired_.empty() && fired < fired_.back()) fired_.clear();
    fired_.push_back(fired);
    while (fired_.size() > 2 && fired - fired_[1] >= window) fired_.pop_front();
  }
  /// Returns pings per second, over the last five seconds or, if the last two pings are farther apart, over their interval; 0
  /// after pings have stopped.
  double hz(Time now) const {
    if (fired_.size() < 2) return 0;
    const double mean_s = sonar::seconds(fired_.back() - fired_.front()) / static_cast<double>(fired_.size() - 1);
    const bool has_stopped = sonar::seconds(now - fired_.back()) > std::max(stopped_after_s, 2 * mean_s);
    return has_stopped || mean_s <= 0 ? 0 : 1 / mean_s;
  }

 private:
  static constexpr std::chrono::seconds window{5};
  static constexpr double stopped_after_s = 2;

  std::deque<Time> fired_;
};

}  // namespace sonar
