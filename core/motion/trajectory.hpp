// The way of one body through the world: poses at known times, and the pose and the motion at any time between them.
// Read from files by trajectory_file.hpp, played against a clock by playback.hpp; pure, no clock, no file.
#pragma once

#include <chrono>
#include <cstddef>
#include <vector>

#include "core/base/geometry.hpp"

namespace sonar::motion {

using Ns = std::chrono::nanoseconds;

/// How a body moves; at rest by default.
struct Motion {
  Vec3d velocity_mps;            // world axes
  Vec3d angular_velocity_radps;  // body axes
};
struct Moment {
  Pose body_in_world;  // world ENU, body FLU
  Motion moves;
};

/// Poses in the order of time, with velocities where the file had them. `times` count from the start of the file, which may
/// lie before the first pose of this body, as its end may lie after the last one: bodies of one file share both.
struct Points {
  std::vector<Ns> times;                        // times, not negative, in increasing order
  std::vector<Pose> poses;                      // as many poses as times
  std::vector<Vec3d> velocities_mps;            // world axes; as many, or none
  std::vector<Vec3d> angular_velocities_radps;  // body axes; as many, or none

  bool operator==(const Points&) const = default;
};

class Trajectory {
 public:
  /// Needs at least one point. `duration` is that of the whole file, at least the last time.
  explicit Trajectory(Points points, Ns duration = Ns{0});

  /// Between points the pose moves in a straight line (lerp) and turns evenly (slerp); outside of them it is held.
  /// The motion is what the file says, interpolated, else that of the way between the two points; at a point that of what
  /// follows, at the last one of what went before. Where the pose is held it is rest.
  Moment at(Ns time) const;

  Ns duration() const { return duration_; }
  std::size_t size() const { return points_.times.size(); }
  const Points& points() const { return points_; }
  /// The same points to the last bit.
  bool operator==(const Trajectory&) const = default;

 private:
  Motion between(std::size_t after, double u) const;
  Points points_;
  Ns duration_;
};

}  // namespace sonar::motion
