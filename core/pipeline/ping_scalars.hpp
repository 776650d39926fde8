// The handful of numbers that change from ping to ping: where the sonar is, and the water it is in.
#pragma once

#include "core/base/geometry.hpp"
#include "core/pipeline/ping_plan.hpp"
#include "core/sonar/ping.hpp"

namespace sonar {

/// Geometry of one echo of a moving sonar: the place scatters when the pulse passes, at half the echo's time of flight, and its
/// direction is measured in the sonar's axes at reception.
struct EchoGeometry {
  Vec3d from_sonar_m;  // sonar axes at reception
  Vec3d moved_m;       // how far the sonar had moved by then, in the axes of PingScalars::seen_from
  Rotation turn;       // from those axes to the ones at reception
};

struct PingScalars {
  double sound_speed_mps = 1500;
  double absorption_np_per_m = 0;  // one way, true
  double source_upa = 1;           // amplitude at 1 m
  double max_range_m = 0;          // true range of the last sample that can still receive
  double min_range_m = 0;          // true range from `seen_from`: nearer echoes end before the first sample
  double samples_per_m = 0;        // fractional sample of a true range r: r * samples_per_m - sample_offset
  double sample_offset = 0.5;      // PingPlan::sample_offset
  double turns_per_m = 0;          // carrier turns per metre of one-way range, 2 f / c
  Rotation world_from_sonar;
  Vec3 position_in_scene;  // relative to RayScene::origin() [m]

  // Origin of rays and cells, and its motion. An echo from range r bounces at r / c and returns at 2 r / c.
  Pose seen_from;        // the sonar in the world half way through the ping; the pose of firing when it rests
  double seen_at_s = 0;  // after firing
  bool moves = false;
  Twist twist;
  double doppler_m_per_mps = 0;  // an echo that closes in by 1 m/s appears so much farther (docs/acoustics.md, section 4)

  /// Echo of a place in the axes of `seen_from`.
  EchoGeometry echo_geometry(Vec3d from_sonar_m) const;
  /// How many columns may lie between where a place was looked for and where its echo is received.
  int columns_turned(const PingPlan& plan) const;
  /// The number of samples by which the Doppler shift of a sweep delays the echo from a place in the sonar's axes.
  double doppler_samples(Vec3d from_sonar_m) const;
  double sample_of(double range_m) const { return range_m * samples_per_m - sample_offset; }
};

/// The sonar's pose `seconds` after `pose`.
Pose propagate(const Pose& pose, const Twist& twist, double seconds);

PingScalars make_scalars(const PingPlan& plan, const PingRequest& request, Vec3d scene_origin);

}  // namespace sonar
