// Stage one: a sparse fan of rays from the aperture finds the visible surfaces. The result is a depth map for each column.
// Scatterers belong to the surfaces (scatter.hpp), so rays only determine shadows.
#pragma once

#include <vector>

#include "core/pipeline/fan_refinement.hpp"
#include "core/pipeline/ping_plan.hpp"
#include "core/pipeline/ping_scalars.hpp"
#include "core/pipeline/signals.hpp"
#include "core/scene/ray_scene.hpp"

namespace sonar {

/// Buffers of trace_fan that are kept from ping to ping; one per worker.
struct FanScratch {
  struct Sample : FanSample {
    SurfaceHit surface;
    int stages() const { return 1; }
    const SurfaceHit& surface_at(int) const { return surface; }
    bool same_mirrors(const Sample&) const { return true; }
  };
  std::vector<Sample> samples;
  std::vector<FanInterval> open, halves;
};

/// Traces columns [first, last) and draws the hits into `seen`, whose size must already be set. Returns the number of rays.
std::size_t trace_fan(const RayScene& scene, const PingPlan& plan, const PingScalars& scalars, int first, int last,
                      FanScratch& scratch, DepthMap& seen);

/// Number of columns in a packet of trace_fixed_fan. Which of two triangles a ray on their common edge hits may depend on the
/// other rays of its packet, so callers split columns only between packets.
inline constexpr int fixed_fan_columns = 4;
/// Traces the plan's fixed fan for every column of [first, last), and appends to `hits`.
void trace_fixed_fan(const RayScene& scene, const PingPlan& plan, const PingScalars& scalars, int first, int last,
                     std::vector<FanHit>& hits);

}  // namespace sonar
