#include "daemon/commands/render/snapshots.hpp"

#include <algorithm>
#include <utility>

#include "core/text/format.hpp"

namespace sonar::render {
namespace {

/// Removes poses that follow another in less than `shortest_step`. The last pose stays if only one other is left.
motion::Trajectory thinned(const motion::Points& all) {
  motion::Points kept;
  for (std::size_t i = 0; i < all.times.size(); ++i) {
    const bool is_far = kept.times.empty() || all.times[i] - kept.times.back() >= shortest_step;
    if (!is_far && (i + 1 < all.times.size() || kept.times.size() > 1)) continue;
    kept.times.push_back(all.times[i]);
    kept.poses.push_back(all.poses[i]);
  }
  return motion::Trajectory(std::move(kept));
}

}  // namespace

Steps steps_of(const motion::Trajectory& trajectory) {
  Steps steps;
  if (!trajectory.points().velocities_mps.empty()) return steps;
  const motion::Trajectory way = thinned(trajectory.points());
  const std::vector<motion::Ns>& times = way.points().times;
  for (std::size_t i = 0; i + 1 < times.size(); ++i) {
    const motion::Motion m = way.at(times[i]).moves;  // the motion on the way to the next pose
    const double mps = length(m.velocity_mps), radps = length(m.angular_velocity_radps);
    ++steps.all;
    if (!(mps <= fastest_vehicle_mps && radps <= fastest_vehicle_radps)) ++steps.too_far;
    steps.fastest_mps = std::max(steps.fastest_mps, mps);
    steps.fastest_radps = std::max(steps.fastest_radps, radps);
  }
  return steps;
}

bool are_snapshots(const motion::Trajectory& trajectory) {
  const Steps steps = steps_of(trajectory);
  return steps.too_far * steps_to_one_too_far > steps.all;
}

std::string note_of_snapshots(const motion::Trajectory& trajectory) {
  const Steps steps = steps_of(trajectory);
  return text::format(
      "the poses are read as unconnected snapshots: %zu of %zu steps from one to the next are faster than a vehicle "
      "(%g m/s, %g rad/s; the fastest: %.3g m/s, %.3g rad/s). The sonar does not move during a ping; --motion on moves it",
      steps.too_far, steps.all, fastest_vehicle_mps, fastest_vehicle_radps, steps.fastest_mps, steps.fastest_radps);
}

}  // namespace sonar::render
