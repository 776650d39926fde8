// The trajectory of one body: poses at known times. The class computes the pose and motion at any time between them.
// trajectory_file.hpp reads trajectories from files, playback.hpp plays them at the pace of a clock. This class uses neither
// clocks nor files.
#pragma once

#include <chrono>
#include <cstddef>
#include <vector>

#include "core/base/geometry.hpp"

namespace sonar::motion {

// Detects jumps: pose changes that are too fast to be motion. A jump must not become a velocity, because a velocity shifts
// echoes. The same rule applies to played and sent poses (daemon/emulator/world) and to rendered ones.

inline constexpr double fastest_mps = 30, fastest_radps = 10;

/// True if a velocity exceeds its limit or is not a number.
inline bool is_jump(Vec3d velocity_mps, Vec3d angular_velocity_radps) {
  return !(length(velocity_mps) <= fastest_mps && length(angular_velocity_radps) <= fastest_radps);
}

// Rotations from one orientation to another, and interpolation between the two.

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

using Ns = std::chrono::nanoseconds;

/// The motion of a body. The default means that the body rests.
struct Motion {
  Vec3d velocity_mps;            // world axes
  Vec3d angular_velocity_radps;  // body axes
};
struct Moment {
  Pose body_in_world;  // world ENU, body FLU
  Motion moves;
};

/// Poses in order of time, with velocities if the file has them. `times` count from the start of the file, which all its bodies
/// share. The first pose of a body may be later than the start, and its last pose earlier than the end.
struct Points {
  std::vector<Ns> times;                        // times, not negative, in increasing order
  std::vector<Pose> poses;                      // one for each time
  std::vector<Vec3d> velocities_mps;            // world axes; one for each time, or none
  std::vector<Vec3d> angular_velocities_radps;  // body axes; one for each time, or none

  bool operator==(const Points&) const = default;
};

class Trajectory {
 public:
  /// `points` must have at least one point. `duration` is the duration of the whole file, at least the last time.
  explicit Trajectory(Points points, Ns duration = Ns{0});

  /// Between points the body moves in a straight line (lerp) and turns at constant rate (slerp). Before the first and after the
  /// last point it rests. The motion is interpolated from the file's velocities; without velocities it is the mean motion of
  /// the interval. At a point, the interval that begins there counts; at the last point, the one that ends there.
  Moment at(Ns time) const;

  Ns duration() const { return duration_; }
  std::size_t size() const { return points_.times.size(); }
  const Points& points() const { return points_; }
  /// True if all points are exactly equal.
  bool operator==(const Trajectory&) const = default;

 private:
  Motion between(std::size_t after, double u) const;
  Points points_;
  Ns duration_;
};

}  // namespace sonar::motion
