// Playback converts clock time to time in a trajectory, with start, speed, loop, pause and seek. It uses integer nanoseconds and
// millionths, so that a stepped run can be repeated exactly. daemon/emulator/world has one Playback for each body.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/base/geodesy.hpp"
#include "core/base/geometry.hpp"
#include "core/base/plausible_angles.hpp"
#include "core/base/units.hpp"

namespace sonar::motion {

// The trajectory of one body: poses at known times. Trajectory computes the pose and motion at any time between them.
// trajectory_file.hpp reads trajectories from files, Playback plays them at the pace of a clock. Neither class uses clocks or
// files.

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
  std::vector<Ns> times;                        // not negative, in increasing order
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

/// Seconds of the trajectory per second of the clock, as a whole number of millionths: 2.5 is 2,500,000.
struct Speed {
  std::int64_t millionths = 1'000'000;
  static constexpr double slowest = 0.001, fastest = 1000;
  /// Rounds to a millionth; nullopt if the factor is not between slowest and fastest.
  static std::optional<Speed> from(double factor);
  double factor() const { return static_cast<double>(millionths) * 1e-6; }
  bool operator==(const Speed&) const = default;
};

struct PlaybackRules {
  Speed speed;
  bool loop = false;
  Ns start{0};  // trajectory time at which playing begins; if negative, the body first waits at the first pose
  bool operator==(const PlaybackRules&) const = default;
};

/// A trajectory that a body follows, the rules of its playback, and its origin.
struct Plan {
  std::shared_ptr<const Trajectory> trajectory = {};  // null = none
  PlaybackRules rules = {};
  std::string file = {};                // name of the file as the user wrote it
  std::string about = {};               // format, frame and length, as text for the user
  ImplausibleAngle largest_angle = {};  // as in TrajectoryFile::Body
  std::optional<Geodetic> origin = {};  // as in TrajectoryFile
  explicit operator bool() const { return trajectory != nullptr; }
};
/// True if both plans have the same points and the same rules.
bool is_same(const Plan& a, const Plan& b);

class Playback {
 public:
  Playback() = default;
  Playback(Ns duration, const PlaybackRules& rules, Time begun)
      : duration_(duration), rules_(rules), clock_at_(begun), place_at_(rules.start) {}

  struct Place {
    Ns at{0};         // time in the trajectory, 0 to its duration
    double rate = 0;  // seconds of the trajectory per second of the clock: 0 while paused, before the start, after the end
  };
  /// A round of a loop takes the trajectory's duration, in trajectory time. The end of a round is the start of the next one.
  Place place(Time clock) const;

  /// Pauses from the time `clock` on. After this call, place() may return different results for earlier times.
  void pause(Time clock);
  void resume(Time clock);
  void seek(Time clock, Ns to);  // 0 to duration
  void use_speed(Time clock, Speed speed);
  /// Call it when the clock jumps ahead by `by`. The position in the trajectory then does not change.
  void skip(Ns by) { clock_at_ += by; }

  bool paused() const { return paused_; }
  bool ended(Time clock) const { return !rules_.loop && line(clock) >= duration_; }
  Ns duration() const { return duration_; }
  const PlaybackRules& rules() const { return rules_; }

 private:
  /// Time in the trajectory before it is limited to the ends or wrapped by loops.
  Ns line(Time clock) const;
  void begin_anew(Time clock);

  Ns duration_{0};
  PlaybackRules rules_;
  Time clock_at_{};  // clock time at which the trajectory time was place_at_
  Ns place_at_{0};
  bool paused_ = false;
};

}  // namespace sonar::motion
