// The daemon's time: real (UNIX time that never jumps) or stepped (moves only when told). I/O thread only.
#pragma once

#include <algorithm>
#include <chrono>

#include "core/base/units.hpp"

namespace sonar {

class Clock {
 public:
  explicit Clock(bool stepped)
      : stepped_(stepped),
        started_(std::chrono::steady_clock::now()),
        origin_(stepped ? Time{} : std::chrono::time_point_cast<std::chrono::nanoseconds>(std::chrono::system_clock::now())) {}

  bool stepped() const { return stepped_; }
  /// Stepped time begins at the epoch: packets of two runs are the same.
  Time now() const { return stepped_ ? origin_ : origin_ + (std::chrono::steady_clock::now() - started_); }
  /// When a timer must expire for `t`. Real time only.
  std::chrono::steady_clock::time_point timer_at(Time t) const { return started_ + (t - origin_); }
  /// Stepped time only; never backwards.
  void advance_to(Time t) { origin_ = std::max(origin_, t); }

 private:
  bool stepped_;
  std::chrono::steady_clock::time_point started_;
  Time origin_;  // real: the UNIX time at started_; stepped: now
};

}  // namespace sonar
