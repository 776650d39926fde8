// Detects files of unrelated poses, as in data sets. Such poses are too far apart for a trajectory, so they do not define the
// motion within a ping.
#pragma once

#include <string>

#include "core/motion/trajectory.hpp"

namespace sonar::render {

/// Highest speeds of a carrier of an imaging sonar: a fast boat, and a towfish that rolls. If more than one in
/// `steps_to_one_too_far` steps is faster, the file contains snapshots, not a trajectory, unless it has velocities.
inline constexpr double fastest_vehicle_mps = 15, fastest_vehicle_radps = 5;
inline constexpr std::size_t steps_to_one_too_far = 10;
/// Poses that are closer in time count as one step, because the jitter of a fast log is not motion.
inline constexpr motion::Ns shortest_step = std::chrono::milliseconds(100);

/// The steps of a trajectory.
struct Steps {
  std::size_t all = 0, too_far = 0;
  double fastest_mps = 0, fastest_radps = 0;
};
Steps steps_of(const motion::Trajectory& trajectory);
bool are_snapshots(const motion::Trajectory& trajectory);
/// Returns one sentence about a trajectory that is read as snapshots.
std::string note_of_snapshots(const motion::Trajectory& trajectory);

}  // namespace sonar::render
