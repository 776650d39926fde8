// The poses of one body in the last two seconds, and its pose at any time: interpolated, extrapolated for a short time, or held.
// World has one history for each vehicle and moving object. Times are the sender's stamps; World converts our times to them.
#pragma once

#include <deque>
#include <optional>

#include "core/base/geometry.hpp"
#include "core/base/units.hpp"
#include "core/motion/trajectory.hpp"

namespace sonar {

class PoseHistory {
 public:
  struct Sample {
    Time at{};
    Pose pose;                                    // pose of the body in the world
    std::optional<Vec3d> velocity_mps;            // in body axes
    std::optional<Vec3d> angular_velocity_radps;  // in body axes
  };
  using Motion = motion::Motion;
  static constexpr std::chrono::nanoseconds length = std::chrono::seconds(2);
  static constexpr std::size_t most_samples = 2048;  // two seconds at the rate limit of 1 kHz

  void clear() { samples_.clear(); }
  bool empty() const { return samples_.empty(); }
  std::size_t size() const { return samples_.size(); }
  const Sample& newest() const { return samples_.back(); }

  /// Adds a sample. `sample.at` must not be before newest().at; an equal time replaces the newest sample.
  void put(const Sample& sample);
  /// Replaces newest(), for poses above the rate limit. `sample.at` must not be before newest().at; the history must not be
  /// empty.
  void replace_newest(const Sample& sample) { samples_.back() = sample; }
  /// Returns the pose at a time. Between samples it is interpolated (lerp, slerp); before the first sample it is held. After the
  /// last sample it is extrapolated for at most `extrapolate_max`, with the sample's velocity or else with the difference of the
  /// last two samples (unless that is a jump), and then held. The history must not be empty.
  Pose at(Time t, std::chrono::nanoseconds extrapolate_max) const;
  /// Returns the motion of the pose of at(): between samples, their difference per time; after the newest sample, its velocity;
  /// zero where the pose is held.
  Motion motion_at(Time t, std::chrono::nanoseconds extrapolate_max) const;

 private:
  using Samples = std::deque<Sample>;
  static Motion between(const Sample& before, const Sample& after);
  Motion newest_motion() const;
  /// Returns the first sample not before t.
  Samples::const_iterator not_before(Time t) const;
  Pose beyond_newest(std::chrono::nanoseconds ahead) const;
  Samples samples_;
};

using motion::rotation_between;
using motion::slerp;

}  // namespace sonar
