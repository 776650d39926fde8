// Guesses the axes of the poses in a file from the fact that a vehicle stays more or less upright.
#pragma once

#include <vector>

#include "core/base/geometry.hpp"

namespace sonar {

inline constexpr double tilted = 0.5;  // further than 60 deg from upright

/// Returns the upward component of the body's z axis, -1 to 1.
inline double upright(Quatd q) { return 1 - 2 * (q.x * q.x + q.y * q.y); }

/// Axes of a body, other than ours, that files of poses are often in.
struct OtherAxes {
  const char* text;  // "have the axes of a camera"
  const char* cure;
  Vec3d up;  // upward direction in these axes
};
/// Returns the axes in which a body that mostly lies on its side would be nearly upright; null if there are none.
const OtherAxes* axes_of(const std::vector<Pose>& poses);
/// Returns whether the mounts turn the sonars upright in these axes.
bool are_upright(const std::vector<Pose>& mounts, const OtherAxes& axes);

}  // namespace sonar
