// Inputs of the steps that make echoes of a scene: the scene as it stands, and values of one ping.
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

/// References that live as long as the ping. Bodies have been placed in `rays`; `cells` belong to its scene.
struct PingContext {
  const RayScene& rays;
  SurfaceCells& cells;  // builds the tiles that come into view
  std::span<const Pose> bodies_in_world;
  const std::vector<LawTable>& laws;      // by material (laws_of)
  const std::vector<float>& turned_away;  // by object (turned_away_of); neither is looked at by rays that are scatterers
  const PingPlan& plan;
  const PingScalars& scalars;
  const simd::Kernels& kernels;
  Parallel& pool;

  const Scene& scene() const { return rays.scene(); }
};

}  // namespace sonar
