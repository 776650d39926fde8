// Rotations from one orientation to another, and interpolation between the two.
#pragma once

#include "core/base/geometry.hpp"

namespace sonar::motion {

/// The shortest rotation from a to b, as a vector [rad] in the axes of a.
inline Vec3d rotation_between(Quatd a, Quatd b) {
  Quatd d = conjugate(a) * b;
  if (d.w < 0) d = {-d.w, -d.x, -d.y, -d.z};
  const double sine = std::sqrt(d.x * d.x + d.y * d.y + d.z * d.z);
  if (sine < 1e-12) return {2 * d.x, 2 * d.y, 2 * d.z};
  const double factor = 2 * std::atan2(sine, d.w) / sine;
  return {factor * d.x, factor * d.y, factor * d.z};
}

/// The orientation at fraction u of the shortest rotation from a (u = 0) to b (u = 1).
inline Quatd slerp(Quatd a, Quatd b, double u) { return normalized(a * turned_by(u * rotation_between(a, b))); }

}  // namespace sonar::motion
