// Finds degrees that were sent or written where radians are expected.
#pragma once

#include <algorithm>
#include <cmath>

#include "core/base/geometry.hpp"

namespace sonar {

/// The largest absolute angle if one of the angles is implausible as radians: a roll or pitch above half a turn, or a yaw above
/// ten turns (some senders do not wrap headings). Else 0.
inline double angle_beyond_radians(const RollPitchYaw& a) {
  constexpr double most_tilt_rad = 1.01 * pi, most_yaw_rad = 10 * 2 * pi;
  const double tilt_rad = std::max(std::abs(a.roll_rad), std::abs(a.pitch_rad)), yaw_rad = std::abs(a.yaw_rad);
  return tilt_rad > most_tilt_rad || yaw_rad > most_yaw_rad ? std::max(tilt_rad, yaw_rad) : 0;
}

}  // namespace sonar
