// The values that change from ping to ping: the pose of the sonar, and the properties of the water.
#pragma once

#include "core/base/geometry.hpp"
#include "core/pipeline/ping_plan.hpp"
#include "core/sonar/ping.hpp"

namespace sonar {

/// Geometry of one echo for a moving sonar. The pulse reaches the target after half of the echo's time of flight. The direction
/// of the echo is measured in the sonar's axes at reception.
struct EchoGeometry {
  Vec3d from_sonar_m;  // sonar axes at reception
  Vec3d moved_m;       // movement of the sonar until the scattering, axes of PingScalars::seen_from
  Rotation turn;       // from the axes of seen_from to those at reception
};

struct PingScalars {
  double sound_speed_mps = 1500;
  double absorption_np_per_m = 0;  // one way, true
  double source_upa = 1;           // amplitude at 1 m
  double max_range_m = 0;          // largest true range whose echoes reach the last sample
  double min_range_m = 0;          // true range from `seen_from`; echoes from nearer points end before the first sample
  double samples_per_m = 0;        // fractional sample of a true range r: r * samples_per_m - sample_offset
  double sample_offset = 0.5;      // PingPlan::sample_offset
  double turns_per_m = 0;          // carrier turns per metre of one-way range, 2 f / c
  Rotation world_from_sonar;
  Vec3 position_in_scene;  // relative to RayScene::origin() [m]

  // The origin of rays and cells, and its motion. An echo from range r is reflected at r / c and received at 2 r / c.
  Pose seen_from;        // the sonar in the world at the middle of the ping; the pose of firing if it does not move
  double seen_at_s = 0;  // time of `seen_from` after firing
  bool moves = false;
  Twist twist;
  double doppler_m_per_mps = 0;  // added to the range of a target that approaches at 1 m/s (docs/acoustics.md, section 4)

  /// Geometry of the echo of a point in the axes of `seen_from`.
  EchoGeometry echo_geometry(Vec3d from_sonar_m) const;
  /// Largest distance, in columns, between the column in which a point is traced and the column in which its echo is received.
  int columns_turned(const PingPlan& plan) const;
  /// Number of samples by which the Doppler shift of a sweep delays the echo from a point in the sonar's axes.
  double doppler_samples(Vec3d from_sonar_m) const;
  double sample_of(double range_m) const { return range_m * samples_per_m - sample_offset; }
};

/// The pose of the sonar `seconds` after `pose`.
Pose propagate(const Pose& pose, const Twist& twist, double seconds);

PingScalars make_scalars(const PingPlan& plan, const PingRequest& request, Vec3d scene_origin);

}  // namespace sonar
