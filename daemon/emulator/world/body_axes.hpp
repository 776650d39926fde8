// Guesses the axes of the poses in a file, assuming that vehicles stay roughly upright.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/base/geometry.hpp"

namespace sonar {

inline constexpr double tilted = 0.5;  // upright() of a body that is tilted by 60 degrees

/// Returns the upward component of the body's z axis, -1 to 1.
inline double upright(Quatd q) { return 1 - 2 * (q.x * q.x + q.y * q.y); }

/// Body axes, other than ours, that pose files often use.
struct OtherAxes {
  const char* text;  // such as "have the axes of a camera"
  const char* cure;
  Vec3d up;  // upward direction in these axes
};
/// Returns the axes in which these poses would be nearly upright, although in our axes most of them lie on their side; null if
/// there are no such axes.
const OtherAxes* axes_of(const std::vector<Pose>& poses);
/// True if the mounts make the sonars upright in these axes.
bool are_upright(const std::vector<Pose>& mounts, const OtherAxes& axes);

// Finds files of poses whose angles were written in radians although their columns are degrees.

/// Returns the reason why the headings of these poses, in the order of time, are probably radians that were read as degrees.
/// Returns nullopt if they are plausible, or if the vehicle neither moves on a curved path nor makes a whole turn.
std::optional<std::string> radians_read_as_degrees(const std::vector<Pose>& poses);

}  // namespace sonar
