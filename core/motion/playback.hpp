// Computes which moment of a trajectory is shown at a time of a clock, with start, speed, loop, pause and seek. It uses integer
// nanoseconds and millionths, so that a stepped run gives the same moments every time; daemon/world has one per body.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "core/base/units.hpp"
#include "core/motion/trajectory.hpp"

namespace sonar::motion {

/// Seconds of the trajectory for a second of the clock, exactly: 2.5 is 2,500,000 millionths.
struct Speed {
  std::int64_t millionths = 1'000'000;
  static constexpr double slowest = 0.001, fastest = 1000;
  /// Rounded to a millionth; nothing outside of slowest to fastest.
  static std::optional<Speed> from(double factor);
  double factor() const { return static_cast<double>(millionths) * 1e-6; }
  bool operator==(const Speed&) const = default;
};

struct PlaybackRules {
  Speed speed;
  bool loop = false;
  Ns start{0};  // time in the trajectory at which playing begins; if it is negative, playing waits so long at the first pose
  bool operator==(const PlaybackRules&) const = default;
};

/// A trajectory that a body follows, how it is played, and where it is from.
struct Plan {
  std::shared_ptr<const Trajectory> trajectory = {};  // null = nothing
  PlaybackRules rules = {};
  std::string file = {};   // the file, as it was named
  std::string about = {};  // format, frame, length, for people
  explicit operator bool() const { return trajectory != nullptr; }
};
/// Whether one who follows the one need not notice the other: the same points, played in the same way.
bool is_same(const Plan& a, const Plan& b);

class Playback {
 public:
  Playback() = default;
  Playback(Ns duration, const PlaybackRules& rules, Time begun)
      : duration_(duration), rules_(rules), clock_at_(begun), place_at_(rules.start) {}

  struct Place {
    Ns at{0};         // time in the trajectory, 0 to its duration
    double rate = 0;  // seconds of the trajectory for one of the clock: 0 while paused, before the start, after the end
  };
  /// A loop takes as long as the file: its last moment is the first one of the next round, not one beside it.
  Place place(Time clock) const;

  /// From `clock` on. Moments already asked for before it stay what they were only if they are not asked for again.
  void pause(Time clock);
  void resume(Time clock);
  void seek(Time clock, Ns to);  // 0 to duration
  void use_speed(Time clock, Speed speed);
  /// The clock jumps ahead by `by`, and it stands where it stood.
  void skip(Ns by) { clock_at_ += by; }

  bool paused() const { return paused_; }
  bool ended(Time clock) const { return !rules_.loop && line(clock) >= duration_; }
  Ns duration() const { return duration_; }
  const PlaybackRules& rules() const { return rules_; }

 private:
  /// Without ends and rounds.
  Ns line(Time clock) const;
  void begin_anew(Time clock);

  Ns duration_{0};
  PlaybackRules rules_;
  Time clock_at_{};  // then it stood at place_at_
  Ns place_at_{0};
  bool paused_ = false;
};

}  // namespace sonar::motion
