// The daemon's time: real (UNIX time that never jumps) or stepped (advanced only by daemon/server/time/stepped_time.hpp). Only
// the I/O thread uses it.
#pragma once

#include <algorithm>
#include <chrono>
#include <functional>

#include "core/base/units.hpp"

namespace sonar {

class Clock {
 public:
  /// Reads the computer's wall clock. now() does not change if that clock is set, for example by NTP.
  using Wall = Time (*)();
  static Time system_wall() { return std::chrono::time_point_cast<std::chrono::nanoseconds>(std::chrono::system_clock::now()); }
  explicit Clock(bool stepped, Wall wall = system_wall)
      : stepped_(stepped), wall_(wall), started_(std::chrono::steady_clock::now()), origin_(stepped ? Time{} : wall()) {}

  bool stepped() const { return stepped_; }
  /// Returns the time. Stepped time begins at the epoch, so that two runs send the same packets.
  Time now() const { return stepped_ ? origin_ : origin_ + (std::chrono::steady_clock::now() - started_); }
  /// Returns the lead of now() over the wall clock; about 0 until that clock is set. Call it only in real time.
  std::chrono::nanoseconds ahead_of_wall() const { return now() - wall_(); }
  /// Returns the time at which a timer must expire for `t`. Call it only in real time.
  std::chrono::steady_clock::time_point timer_at(Time t) const { return started_ + (t - origin_); }
  /// Advances to a time that is not before now(). Call it only in stepped time.
  void advance_to(Time t) { origin_ = std::max(origin_, t); }
  /// Advances the clock, but not unskipped time. Call it only in stepped time.
  void skip(std::chrono::nanoseconds by) {
    origin_ += by;
    skipped_ += by;
  }
  /// Returns the sum of all skips. Dialogues use unskipped time, so that a jump causes no time-outs and no keep-alives.
  std::chrono::nanoseconds skipped() const { return skipped_; }

 private:
  bool stepped_;
  Wall wall_;
  std::chrono::steady_clock::time_point started_;
  std::chrono::nanoseconds skipped_{0};
  Time origin_;  // real time: the UNIX time at started_; stepped time: now
};

// The function with which a step of stepped time tests whether its client has left.

/// Returns true once the client has closed its end of the connection, or half of it.
using HasLeft = std::function<bool()>;

}  // namespace sonar
