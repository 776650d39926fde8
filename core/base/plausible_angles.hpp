// Finds degrees that were sent or written where radians are expected.
#pragma once

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>
#include <utility>

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

/// Recognises a yaw in radians that is counted on over whole turns, as dead reckoning does: it changes no faster than a vehicle
/// turns, over two turns and more. A yaw in degrees jumps after a turn, and changes 57 times as fast.
class TurnCount {
 public:
  /// Poses in the order of time. False: the yaw does not continue that of the pose before.
  bool add(double yaw_rad, Time at) {
    constexpr double fastest_radps = 2, least_step_rad = 0.05;  // least_step_rad: noise, and poses that come close together
    const std::chrono::duration<double> passed_s = last_ ? at - last_->second : std::chrono::nanoseconds(0);
    const bool goes_on = last_ && std::abs(yaw_rad - last_->first) <= std::max(fastest_radps * passed_s.count(), least_step_rad);
    low_rad_ = goes_on ? std::min(low_rad_, yaw_rad) : yaw_rad;
    high_rad_ = goes_on ? std::max(high_rad_, yaw_rad) : yaw_rad;
    last_ = {yaw_rad, at};
    return goes_on;
  }
  bool has_counted() const { return high_rad_ - low_rad_ > 2 * 2 * pi; }

 private:
  std::optional<std::pair<double, Time>> last_;
  double low_rad_ = 0, high_rad_ = 0;
};

}  // namespace sonar
