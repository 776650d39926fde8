// Computes when the next message of a recording is due: at the pace of the recording, faster or slower. The replay server does
// the waiting.
#pragma once

#include <algorithm>
#include <chrono>
#include <optional>

#include "core/base/units.hpp"

namespace sonar {

class ReplayPace {
 public:
  using Steady = std::chrono::steady_clock;
  static constexpr std::chrono::seconds longest_gap{5};  // longer pauses are shortened; drivers disconnect after ten seconds
  static constexpr std::chrono::milliseconds between_loops{100};  // from the last message to the first of the next loop
  static constexpr std::chrono::milliseconds lateness{200};  // a longer delay is not caught up, so that slow clients get no burst

  /// `speed` > 0. `interval`: time between messages of recordings without times.
  ReplayPace(double speed, std::optional<std::chrono::nanoseconds> interval) : speed_(speed), interval_(interval) {}

  Steady::time_point due(Time recorded_at, Steady::time_point now) {
    if (!last_due_) {
      last_due_ = now;
    } else {
      std::chrono::nanoseconds gap = between_loops;
      if (interval_) {
        gap = *interval_;
      } else if (last_recorded_) {
        gap = std::clamp<std::chrono::nanoseconds>(recorded_at - *last_recorded_, std::chrono::nanoseconds(0), longest_gap);
      }
      *last_due_ += std::chrono::duration_cast<Steady::duration>(
          std::chrono::duration<double, std::nano>(static_cast<double>(gap.count()) / speed_));
      if (now > *last_due_ + lateness) last_due_ = now;
    }
    last_recorded_ = recorded_at;
    return *last_due_;
  }
  /// Call it when the recording begins again.
  void begin_again() { last_recorded_.reset(); }

 private:
  double speed_;
  std::optional<std::chrono::nanoseconds> interval_;
  std::optional<Time> last_recorded_;
  std::optional<Steady::time_point> last_due_;
};

}  // namespace sonar
