// Directions of beams whose delays were computed for a sound speed that is not that of the water (docs/acoustics.md, section
// 6).
#pragma once

#include <algorithm>
#include <cmath>

#include "core/sonar/ping.hpp"
#include "core/sonar/water.hpp"

namespace sonar {

/// Ratio of the sines of a beam's true and reported directions; 1 if bearings are true. It is rounded to steps of 1.2e-4, so
/// that tables stay valid until the vehicle's depth has changed by about 10 m.
inline double bearing_scale_of(const PingRequest& r) {
  constexpr double steps = 1 << 13;
  if (r.bearings == Bearings::are_true) return 1;
  const double true_mps = true_sound_speed_mps(r.water, depth_from_z(r.sonar_in_world.position_m.z));
  return std::round(true_mps / static_cast<double>(r.settings.device_sound_speed_mps) * steps) / steps;
}

/// The true angle of a beam with this reported angle.
inline double true_angle_rad(double reported_rad, double bearing_scale) {
  return bearing_scale == 1 ? reported_rad : std::asin(std::clamp(bearing_scale * std::sin(reported_rad), -1.0, 1.0));
}

}  // namespace sonar
