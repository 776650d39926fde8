// Detects jumps: pose changes too fast to be motion, which must not carry a sonar and shift its echoes. This one rule is used for
// poses that are played, sent (daemon/world) and rendered.
#pragma once

#include "core/base/geometry.hpp"

namespace sonar::motion {

inline constexpr double fastest_mps = 30, fastest_radps = 10;

/// Faster than that, or no number at all.
inline bool is_jump(Vec3d velocity_mps, Vec3d angular_velocity_radps) {
  return !(length(velocity_mps) <= fastest_mps && length(angular_velocity_radps) <= fastest_radps);
}

}  // namespace sonar::motion
