// Inputs of the steps that make the echoes of a scene: the scene at the time of the ping, and the values of one ping.
#pragma once

#include <span>
#include <vector>

#include "core/base/parallel.hpp"
#include "core/pipeline/ping_plan.hpp"
#include "core/pipeline/ping_scalars.hpp"
#include "core/pipeline/scattering_law.hpp"
#include "core/pipeline/simd/kernels.hpp"
#include "core/scene/cells/surface_cells.hpp"
#include "core/scene/ray_scene.hpp"

namespace sonar {

/// References that are valid until the ping is finished. The bodies in `rays` must be at their poses; `cells` must belong to
/// the same scene.
struct PingContext {
  const RayScene& rays;
  SurfaceCells& cells;  // builds the tiles that come into view
  std::span<const Pose> bodies_in_world;
  const std::vector<LawTable>& laws;      // by material (laws_of)
  const std::vector<float>& turned_away;  // by object (turned_away_of); a fixed fan uses neither this nor `laws`
  const PingPlan& plan;
  const PingScalars& scalars;
  const simd::Kernels& kernels;
  Parallel& pool;

  const Scene& scene() const { return rays.scene(); }
};

}  // namespace sonar
