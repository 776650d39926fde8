// Detects jumps: pose changes too fast to be motion. They must not count as velocity, which would shift echoes. The same rule
// applies to poses that are played, sent (daemon/emulator/world) and rendered.
#pragma once

#include "core/base/geometry.hpp"

namespace sonar::motion {

inline constexpr double fastest_mps = 30, fastest_radps = 10;

/// Whether the motion is faster than these limits, or not a number.
inline bool is_jump(Vec3d velocity_mps, Vec3d angular_velocity_radps) {
  return !(length(velocity_mps) <= fastest_mps && length(angular_velocity_radps) <= fastest_radps);
}

}  // namespace sonar::motion
