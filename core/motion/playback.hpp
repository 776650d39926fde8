// Converts clock time to time in a trajectory, with start, speed, loop, pause and seek. It uses integer nanoseconds and
// millionths, so that a stepped run can be repeated exactly. daemon/emulator/world has one Playback for each body.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "core/base/geodesy.hpp"
#include "core/base/plausible_angles.hpp"
#include "core/base/units.hpp"
#include "core/motion/trajectory.hpp"

namespace sonar::motion {

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
