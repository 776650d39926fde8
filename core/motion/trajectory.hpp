// The trajectory of one body: poses at known times. The class computes the pose and motion at any time between them.
// trajectory_file.hpp reads trajectories from files, playback.hpp plays them by a clock. This class uses neither clocks nor
// files.
#pragma once

#include <chrono>
#include <cstddef>
#include <vector>

#include "core/base/geometry.hpp"

namespace sonar::motion {

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
  /// Needs at least one point. `duration` is the duration of the whole file, at least the last time.
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
