// Finds degrees that were sent or written where radians are expected.
#pragma once

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>

#include "core/base/geometry.hpp"
#include "core/base/units.hpp"

namespace sonar {

/// The largest absolute angle that is implausible as radians; 0: all are plausible.
struct ImplausibleAngle {
  double rad = 0;
  bool is_tilt = false;  // a roll or pitch is implausible, not only the yaw

  void include(const ImplausibleAngle& other) {
    rad = std::max(rad, other.rad);
    is_tilt = is_tilt || other.is_tilt;
  }
};

/// A roll or pitch is implausible above half a turn, a yaw above ten turns (some senders do not wrap headings). `counts_turns`:
/// any yaw is plausible, because the sender counts turns (TurnCount).
inline ImplausibleAngle angle_beyond_radians(const RollPitchYaw& a, bool counts_turns = false) {
  constexpr double most_tilt_rad = 1.01 * pi, most_yaw_rad = 10 * 2 * pi;
  const double tilt_rad = std::max(std::abs(a.roll_rad), std::abs(a.pitch_rad)), yaw_rad = std::abs(a.yaw_rad);
  if (tilt_rad > most_tilt_rad) return {std::max(tilt_rad, yaw_rad), true};
  return {!counts_turns && yaw_rad > most_yaw_rad ? std::max(tilt_rad, yaw_rad) : 0, false};
}

/// Recognises a yaw in radians that counts whole turns, as dead reckoning does. Such a yaw changes no faster than a vehicle
/// turns. It covers two turns if it starts within the first turn, or many turns from any start. A yaw in degrees starts
/// anywhere, jumps after a turn, and changes 57 times as fast.
class TurnCount {
 public:
  /// Adds the yaw of a pose; poses must be in the order of time. Returns false if this yaw begins a new series: it is the first
  /// one, or a vehicle cannot have turned to it.
  bool add(double yaw_rad, Time at) {
    const bool goes_on = last_ && is_turn(yaw_rad, at);
    if (!goes_on) {
      constexpr double wrap = 360, about = 10;  // a jump of this size is the wrap of a heading in degrees
      begins_count_ = std::abs(yaw_rad) <= 2 * pi && !(last_ && std::abs(std::abs(yaw_rad - last_->yaw_rad) - wrap) < about);
      first_ = {yaw_rad, at};
      low_rad_ = high_rad_ = yaw_rad;
    }
    low_rad_ = std::min(low_rad_, yaw_rad);
    high_rad_ = std::max(high_rad_, yaw_rad);
    last_ = {yaw_rad, at};
    return goes_on;
  }
  bool has_counted() const {
    constexpr double two_turns_rad = 2 * 2 * pi, many_turns_rad = 360;  // a heading in degrees covers no more than 360
    const double covered_rad = high_rad_ - low_rad_;
    return covered_rad > many_turns_rad || (covered_rad > two_turns_rad && begins_count_);
  }

 private:
  struct Heading {
    double yaw_rad = 0;
    Time at{};
  };
  /// True if a vehicle can have turned to this yaw both from the previous pose and from the first one. The tolerance
  /// least_step_rad allows for noise and for poses at nearly the same time; it does not accumulate from pose to pose.
  bool is_turn(double yaw_rad, Time at) const {
    constexpr double fastest_radps = 2, least_step_rad = 0.05;
    const auto reaches_from = [&](const Heading& from) {
      const double passed_s = std::chrono::duration<double>(at - from.at).count();
      return std::abs(yaw_rad - from.yaw_rad) <= fastest_radps * passed_s + least_step_rad;
    };
    return reaches_from(*last_) && reaches_from(first_);
  }

  std::optional<Heading> last_;
  Heading first_;  // the first pose of the continuous series
  bool begins_count_ = false;
  double low_rad_ = 0, high_rad_ = 0;
};

}  // namespace sonar
