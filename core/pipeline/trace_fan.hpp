// Stage one: a sparse fan of rays from the aperture finds what is visible. The result is a depth map per column; scatterers
// come from the surfaces (scatter.hpp), so rays decide shadows only.
#pragma once

#include <cstdint>
#include <vector>

#include "core/pipeline/fan_refinement.hpp"
#include "core/pipeline/ping_plan.hpp"
#include "core/pipeline/ping_scalars.hpp"
#include "core/scene/ray_scene.hpp"

namespace sonar {

/// What the rays saw, column by column: 1 / x (x = forward coordinate in the sonar's frame) against the tangent z / x. For flat
/// beams (conical off) the horizontal distance stands in for x.
struct DepthMap {
  int first_column = 0, columns = 0, bins = 0;
  std::vector<float> inverse_x;  // [columns][bins + 1], 0 = nothing was hit

  /// Of columns [first, last), to be drawn.
  void shape(int first, int last, int bin_count) {
    first_column = first, columns = last - first, bins = bin_count;
    inverse_x.resize(static_cast<std::size_t>(columns) * static_cast<std::size_t>(bins + 1));
  }
  float* column(int k) { return inverse_x.data() + static_cast<std::ptrdiff_t>(k - first_column) * (bins + 1); }
};

/// Buffers of trace_fan that live from ping to ping; one per worker.
struct FanScratch {
  struct Sample : FanSample {
    SurfaceMet met;
    int stages() const { return 1; }
    const SurfaceMet& met_at(int) const { return met; }
    bool same_way(const Sample&) const { return true; }
  };
  std::vector<Sample> samples;
  std::vector<FanInterval> open, halves;
};

/// Traces columns [first, last) and draws them into the map, which has been shaped to hold them. Returns the number of rays.
std::size_t trace_fan(const RayScene& scene, const PingPlan& plan, const PingScalars& scalars, int first, int last,
                      FanScratch& scratch, DepthMap& seen);

/// One hit of the fixed fan (paper-style sampling: a ray is a scatterer).
struct FanHit {
  int column = 0, ray = 0;
  float range_m = 0, elevation_rad = 0, cosine = 0;
  std::uint32_t object = 0, triangle = 0;
};
/// The plan's fixed fan for every column of [first, last); appends to `hits`.
void trace_fixed_fan(const RayScene& scene, const PingPlan& plan, const PingScalars& scalars, int first, int last,
                     std::vector<FanHit>& hits);

}  // namespace sonar
