// The daemon's time: real (UNIX time that never jumps) or stepped (advanced only by daemon/server/time/stepped_time.hpp). I/O
// thread only.
#pragma once

#include <algorithm>
#include <chrono>

#include "core/base/units.hpp"

namespace sonar {

class Clock {
 public:
  /// Reads the computer's wall clock. If that is set, for example by NTP, now() does not change.
  using Wall = Time (*)();
  static Time system_wall() { return std::chrono::time_point_cast<std::chrono::nanoseconds>(std::chrono::system_clock::now()); }
  explicit Clock(bool stepped, Wall wall = system_wall)
      : stepped_(stepped), wall_(wall), started_(std::chrono::steady_clock::now()), origin_(stepped ? Time{} : wall()) {}

  bool stepped() const { return stepped_; }
  /// Stepped time begins at the epoch, so that two runs send the same packets.
  Time now() const { return stepped_ ? origin_ : origin_ + (std::chrono::steady_clock::now() - started_); }
  /// The lead of now() over the wall clock; about 0 until that clock is set. Real time only.
  std::chrono::nanoseconds ahead_of_wall() const { return now() - wall_(); }
  /// The time at which a timer must expire for `t`. Real time only.
  std::chrono::steady_clock::time_point timer_at(Time t) const { return started_ + (t - origin_); }
  /// Advances to a time that is not before now(). Stepped time only.
  void advance_to(Time t) { origin_ = std::max(origin_, t); }
  /// Advances the clock without advancing unskipped time (stepped mode only).
  void skip(std::chrono::nanoseconds by) {
    origin_ += by;
    skipped_ += by;
  }
  /// The sum of all skips. Conversations use unskipped time, so that a jump causes no time-outs and no keep-alives.
  std::chrono::nanoseconds skipped() const { return skipped_; }

 private:
  bool stepped_;
  Wall wall_;
  std::chrono::steady_clock::time_point started_;
  std::chrono::nanoseconds skipped_{0};
  Time origin_;  // real: the UNIX time at started_; stepped: now
};

}  // namespace sonar
