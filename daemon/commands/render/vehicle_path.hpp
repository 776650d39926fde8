// The pose of the vehicle of a rendered ping: at rest, on the demo's circle, or from a trajectory file.
// World ENU, body FLU; files are read by core/motion.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/base/geometry.hpp"
#include "core/base/result.hpp"
#include "core/base/units.hpp"
#include "core/motion/trajectory_file.hpp"
#include "core/sonar/ping.hpp"

namespace sonar::render {

struct VehiclePath {
  Pose initial;                                          // without a trajectory
  bool orbits = false;                                   // circles the world's z axis, as `trajectory: orbit`
  std::shared_ptr<const motion::Trajectory> trajectory;  // null = none
  Time begins_at{};                                      // the stamp that the trajectory counts from
  bool snapshots = false;                                // its poses are unrelated: no motion
};

/// Highest speeds of a carrier of an imaging sonar: a fast boat, and a towfish that rolls. A file of poses with more than one
/// faster step in `steps_to_one_too_far` is taken as snapshots, not as a trajectory, unless it contains velocities.
inline constexpr double fastest_vehicle_mps = 15, fastest_vehicle_radps = 5;
inline constexpr std::size_t steps_to_one_too_far = 10;
/// Poses closer in time than this are one step: the jitter of a fast log is not motion.
inline constexpr motion::Ns shortest_step = std::chrono::milliseconds(100);

/// The steps of a trajectory.
struct Steps {
  std::size_t all = 0, too_far = 0;
  double fastest_mps = 0, fastest_radps = 0;
};
Steps steps_of(const motion::Trajectory& trajectory);
/// One sentence about a path that is taken as snapshots.
std::string note_of_snapshots(const VehiclePath& path);

/// The vehicle's trajectory in a file, in the file's own time, or its snapshots; an empty name: of the only body in it. Errors:
/// name:line: what.
Result<VehiclePath> path_in(const motion::TrajectoryFile& file, const std::string& name, const std::string& body);

Pose vehicle_at(const VehiclePath& path, Time at);
/// How the sonar on its mount moves then.
Twist sonar_twist_at(const VehiclePath& path, const Pose& mount, Time at);
/// Times of the file's poses; empty without a file.
std::vector<Time> times_of(const VehiclePath& path);

}  // namespace sonar::render
