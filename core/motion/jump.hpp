// Detects jumps: pose changes too fast to be motion. They must not count as velocity, which would shift echoes. The same rule
// applies to played and sent poses (daemon/emulator/world) and to rendered ones.
#pragma once

#include "core/base/geometry.hpp"

namespace sonar::motion {

inline constexpr double fastest_mps = 30, fastest_radps = 10;

/// Whether a velocity exceeds its limit or is not a number.
inline bool is_jump(Vec3d velocity_mps, Vec3d angular_velocity_radps) {
  return !(length(velocity_mps) <= fastest_mps && length(angular_velocity_radps) <= fastest_radps);
}

}  // namespace sonar::motion
