// The trajectory of one body: poses at known times, and the pose and motion at any time between them.
// trajectory_file.hpp reads it from files; playback.hpp plays it by a clock. It uses neither clocks nor files.
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

/// Poses in the order of time, with velocities if the file has them. `times` count from the start of the file. All bodies of a
/// file have the same start and end, so that the first pose of a body may be later, and its last one earlier.
struct Points {
  std::vector<Ns> times;                        // times, not negative, in increasing order
  std::vector<Pose> poses;                      // as many poses as times
  std::vector<Vec3d> velocities_mps;            // world axes; as many, or none
  std::vector<Vec3d> angular_velocities_radps;  // body axes; as many, or none

  bool operator==(const Points&) const = default;
};

class Trajectory {
 public:
  /// Needs at least one point. `duration` is that of the whole file, not less than the last time.
  explicit Trajectory(Points points, Ns duration = Ns{0});

  /// Between points the pose moves in a straight line (lerp) and turns at constant rate (slerp); outside of them it does not
  /// change, and the motion is at rest. The motion is interpolated from the file's velocities, else it is that between the two
  /// points. At a point it is that of the next interval, at the last point that of the interval before.
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
