// The trajectory of one body: poses at known times. Computes the pose and motion at any time between them. trajectory_file.hpp
// reads it from files; playback.hpp plays it by a clock. It uses neither clocks nor files.
#pragma once

#include <chrono>
#include <cstddef>
#include <vector>

#include "core/base/geometry.hpp"

namespace sonar::motion {

using Ns = std::chrono::nanoseconds;

/// The motion of a body; the default is at rest.
struct Motion {
  Vec3d velocity_mps;            // world axes
  Vec3d angular_velocity_radps;  // body axes
};
struct Moment {
  Pose body_in_world;  // world ENU, body FLU
  Motion moves;
};

/// Poses in order of time, with velocities if the file has them. `times` count from the start of the file, which is the same
/// for all its bodies; the first pose of a body may be later than the start, and its last pose earlier than the end.
struct Points {
  std::vector<Ns> times;                        // times, not negative, in increasing order
  std::vector<Pose> poses;                      // one for each time
  std::vector<Vec3d> velocities_mps;            // world axes; one for each time, or none
  std::vector<Vec3d> angular_velocities_radps;  // body axes; one for each time, or none

  bool operator==(const Points&) const = default;
};

class Trajectory {
 public:
  /// Needs at least one point. `duration` is that of the whole file, not less than the last time.
  explicit Trajectory(Points points, Ns duration = Ns{0});

  /// Between points the body moves in a straight line (lerp) and turns at constant rate (slerp); before the first and after the
  /// last point it rests. The motion is interpolated from the file's velocities; without these it is the mean motion of the
  /// interval. At a point the interval is the one that begins there; at the last point, the one that ends there.
  Moment at(Ns time) const;

  Ns duration() const { return duration_; }
  std::size_t size() const { return points_.times.size(); }
  const Points& points() const { return points_; }
  /// Whether all points are exactly equal.
  bool operator==(const Trajectory&) const = default;

 private:
  Motion between(std::size_t after, double u) const;
  Points points_;
  Ns duration_;
};

}  // namespace sonar::motion
