// The handful of numbers that change from ping to ping: where the sonar is, and the water it is in.
#pragma once

#include "core/base/geometry.hpp"
#include "core/pipeline/ping_plan.hpp"
#include "core/sonar/ping.hpp"

namespace sonar {

struct PingScalars {
  double sound_speed_mps = 1500;
  double absorption_np_per_m = 0;  // one way, true
  double source_upa = 1;           // amplitude at 1 m
  double max_range_m = 0;          // true range of the last sample that can still receive
  double samples_per_m = 0;        // fractional sample of a true range r: r * samples_per_m - sample_offset
  double sample_offset = 0.5;      // PingPlan::sample_offset
  double turns_per_m = 0;          // carrier turns per metre of one-way range, 2 f / c
  Rotation world_from_sonar;
  Vec3 position_in_scene;  // relative to RayScene::origin() [m]

  double sample_of(double range_m) const { return range_m * samples_per_m - sample_offset; }
};

PingScalars make_scalars(const PingPlan& plan, const PingRequest& request, Vec3d scene_origin);

}  // namespace sonar
