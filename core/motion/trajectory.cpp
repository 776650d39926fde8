#include "core/motion/trajectory.hpp"

#include <algorithm>
#include <cassert>

#include "core/base/units.hpp"

namespace sonar::motion {

Trajectory::Trajectory(Points points, Ns duration)
    : points_(std::move(points)), duration_(std::max(duration, points_.times.back())) {
  assert(points_.poses.size() == points_.times.size());
  assert(points_.velocities_mps.empty() || points_.velocities_mps.size() == points_.times.size());
  assert(points_.angular_velocities_radps.empty() || points_.angular_velocities_radps.size() == points_.times.size());
}

/// Motion in the interval that ends at point `after`, at fraction u of the interval.
Motion Trajectory::between(std::size_t after, double u) const {
  const std::size_t before = after - 1;
  // The times of points increase, so there is no division by 0 s.
  const double per_s = 1 / seconds(points_.times[after] - points_.times[before]);
  const Pose &a = points_.poses[before], &b = points_.poses[after];
  const auto interpolated = [&](const std::vector<Vec3d>& values) {
    return values[before] + u * (values[after] - values[before]);
  };
  Motion moves;
  // If the file has no velocities, these are the mean velocities of the interval: world axes [m/s], body axes [rad/s].
  moves.velocity_mps =
      points_.velocities_mps.empty() ? per_s * (b.position_m - a.position_m) : interpolated(points_.velocities_mps);
  moves.angular_velocity_radps = points_.angular_velocities_radps.empty() ? per_s * rotation_between(a.orientation, b.orientation)
                                                                          : interpolated(points_.angular_velocities_radps);
  return moves;
}

Moment Trajectory::at(Ns time) const {
  const std::vector<Ns>& times = points_.times;
  // Before the first point and after the last one the body rests at the pose of that point.
  if (time < times.front()) return {points_.poses.front(), {}};
  if (time > times.back() || times.size() == 1) return {points_.poses.back(), {}};
  if (time == times.back()) return {points_.poses.back(), between(times.size() - 1, 1)};
  // The first point later than `time`. The current interval ends at this point.
  const auto after = static_cast<std::size_t>(std::upper_bound(times.begin(), times.end(), time) - times.begin());
  const Pose &a = points_.poses[after - 1], &b = points_.poses[after];
  // Fraction of the interval, in [0, 1); differences of whole nanoseconds are exact.
  const double u =
      static_cast<double>((time - times[after - 1]).count()) / static_cast<double>((times[after] - times[after - 1]).count());
  const Motion moves = between(after, u);
  // At the time of a point the pose is exactly the pose of the point.
  if (u == 0) return {a, moves};
  return {{a.position_m + u * (b.position_m - a.position_m), slerp(a.orientation, b.orientation, u)}, moves};
}

}  // namespace sonar::motion
