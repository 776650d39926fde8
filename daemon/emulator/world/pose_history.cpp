#include "daemon/emulator/world/pose_history.hpp"

#include <algorithm>
#include <cmath>

namespace sonar {
namespace {
// Samples that are closer in time give no speed, because the difference of their stamps is mostly jitter.
constexpr std::chrono::nanoseconds shortest_difference = std::chrono::milliseconds(1);
}  // namespace

void PoseHistory::put(const Sample& sample) {
  if (!samples_.empty() && samples_.back().at == sample.at) {
    samples_.back() = sample;
    return;
  }
  samples_.push_back(sample);
  while (samples_.size() > most_samples || (samples_.size() > 2 && sample.at - samples_.front().at > length))
    samples_.pop_front();
}

PoseHistory::Motion PoseHistory::between(const Sample& before, const Sample& after) {
  const auto gap = after.at - before.at;
  if (gap < shortest_difference) return {};
  const double per_s = 1 / seconds(gap);
  return {per_s * (after.pose.position_m - before.pose.position_m),
          per_s * rotation_between(before.pose.orientation, after.pose.orientation)};
}

/// Returns the velocities from the sender, else the difference of the last two poses. After a jump the motion is zero, because a
/// vehicle that was moved elsewhere stays there.
PoseHistory::Motion PoseHistory::newest_motion() const {
  const Sample& last = samples_.back();
  Motion motion;
  if (samples_.size() > 1) motion = between(samples_[samples_.size() - 2], last);
  if (motion::is_jump(motion.velocity_mps, motion.angular_velocity_radps)) motion = {};
  if (last.velocity_mps) motion.velocity_mps = rotate(last.pose.orientation, *last.velocity_mps);
  if (last.angular_velocity_radps) motion.angular_velocity_radps = *last.angular_velocity_radps;
  return motion;
}

Pose PoseHistory::beyond_newest(std::chrono::nanoseconds ahead) const {
  const Sample& last = samples_.back();
  const double ahead_s = seconds(ahead);
  const Motion motion = newest_motion();
  return {last.pose.position_m + ahead_s * motion.velocity_mps,
          normalized(last.pose.orientation * turned_by(ahead_s * motion.angular_velocity_radps))};
}

PoseHistory::Samples::const_iterator PoseHistory::not_before(Time t) const {
  return std::lower_bound(samples_.begin(), samples_.end(), t, [](const Sample& s, Time x) { return s.at < x; });
}

/// Returns zero where at() holds a pose, so that pose and motion agree.
PoseHistory::Motion PoseHistory::motion_at(Time t, std::chrono::nanoseconds extrapolate_max) const {
  if (t - samples_.back().at > extrapolate_max || t < samples_.front().at) return {};
  const auto after = not_before(t);
  if (after == samples_.end() || (after->at == t && after + 1 == samples_.end())) return newest_motion();
  return after->at == t ? between(*after, *(after + 1)) : between(*(after - 1), *after);
}

Pose PoseHistory::at(Time t, std::chrono::nanoseconds extrapolate_max) const {
  const auto after = not_before(t);
  if (after == samples_.end()) return beyond_newest(std::min<std::chrono::nanoseconds>(t - samples_.back().at, extrapolate_max));
  if (after->at == t || after == samples_.begin()) return after->pose;
  const Sample& a = *(after - 1);
  const Sample& b = *after;
  const double u = seconds(t - a.at) / seconds(b.at - a.at);
  return {a.pose.position_m + u * (b.pose.position_m - a.pose.position_m), slerp(a.pose.orientation, b.pose.orientation, u)};
}

}  // namespace sonar
