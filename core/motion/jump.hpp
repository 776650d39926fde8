// Detects jumps: pose changes that are too fast to be motion. A jump must not become a velocity, because a velocity shifts
// echoes. The same rule applies to played and sent poses (daemon/emulator/world) and to rendered ones.
#pragma once

#include "core/base/geometry.hpp"

namespace sonar::motion {

inline constexpr double fastest_mps = 30, fastest_radps = 10;

/// True if a velocity exceeds its limit or is not a number.
inline bool is_jump(Vec3d velocity_mps, Vec3d angular_velocity_radps) {
  return !(length(velocity_mps) <= fastest_mps && length(angular_velocity_radps) <= fastest_radps);
}

}  // namespace sonar::motion
