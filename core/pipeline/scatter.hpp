// Stage two: the surface cells in view, as far as the rays saw them, become echoes: where on the sample grid, in which column,
// how strong, with which carrier phase. Their speckle is the surface's own. Also the fixed fan and analytic point targets.
#pragma once

#include <complex>
#include <optional>
#include <span>
#include <vector>

#include "core/pipeline/ping_plan.hpp"
#include "core/pipeline/ping_scalars.hpp"
#include "core/pipeline/scattering_law.hpp"
#include "core/pipeline/simd/kernels.hpp"
#include "core/pipeline/trace_fan.hpp"
#include "core/scene/cells/surface_cells.hpp"
#include "core/scene/ray_scene.hpp"

namespace sonar {

/// Echoes waiting to be summed. In expected power, re holds the power and im is 0.
struct Echoes {
  explicit Echoes(int capacity = 0) { reserve(capacity); }
  void reserve(int capacity);
  int capacity() const { return static_cast<int>(column.size()) - 16; }  // kernels may write one vector past the end
  simd::EchoArrays at(int index) { return {sample.data() + index, re.data() + index, im.data() + index, column.data() + index}; }
  void add(float at_sample, std::complex<float> amplitude, int in_column);

  int count = 0;
  std::vector<float> sample, re, im;
  std::vector<std::int32_t> column;
};

/// A tile with this ping's constants, and the columns it can reach.
struct TileToSound {
  simd::TileSeen seen;
  int first_column = 0, last_column = 0;  // half-open
};

/// The scattering law of every material of the scene, as this ping hears it.
std::vector<LawTable> laws_of(const Scene& scene, const PingPlan& plan, const PingScalars& scalars);

/// Prepares the tiles in view, in parallel; the order is kept. The tiles point into `laws` (laws_of), which must outlive them.
void prepare_tiles(const std::vector<TileInView>& in_view, const SurfaceCells& cells, const Scene& scene,
                   std::span<const LawTable> laws, const PingPlan& plan, const PingScalars& scalars, Parallel& pool,
                   std::vector<TileToSound>& tiles);

simd::GroupView make_group_view(const PingPlan& plan, const PingScalars& scalars, const DepthMap& seen);

/// For each group of `group_columns` columns, the tiles that reach into it, in order.
void sort_tiles(const std::vector<TileToSound>& tiles, int group_columns, int groups,
                std::vector<std::vector<std::uint32_t>>& by_group);

/// Appends the echoes of tiles[wanted[from, ...)] until they or the room run out; returns the next place in `wanted`.
std::size_t scatter(const std::vector<TileToSound>& tiles, std::span<const std::uint32_t> wanted, std::size_t from,
                    const simd::GroupView& group, const simd::Kernels& kernels, Echoes& echoes);

/// One echo a hit (paper-style): sigma = mu cos r^2 dOmega, speckle keyed by (seed, object, column, ray). Appends.
void scatter_hits(std::span<const FanHit> hits, const Scene& scene, std::span<const LawTable> laws, const PingPlan& plan,
                  const PingScalars& scalars, Seed seed, const simd::Kernels& kernels, Echoes& echoes);

/// An echo without a surface: coupled to the beams at its exact direction, never snapped to a column.
struct PointEcho {
  double sine = 0;  // y / r
  double sample = 0;
  std::complex<double> amplitude;  // [uPa]
};
/// The echo of a place in the axes of PingScalars::seen_from whose backscattering amplitude is `strength_m` [m]: pressure at 1 m
/// per pressure there, sqrt of the cross-section, with a phase if it has one. Nothing when the sonar does not hear that place;
/// what hides it is the caller's business.
std::optional<PointEcho> point_echo(Vec3d from_sonar_m, std::complex<double> strength_m, const PingPlan& plan,
                                    const PingScalars& scalars);
/// Point targets in the fan that no surface hides.
std::vector<PointEcho> scatter_points(const RayScene& scene, std::span<const Pose> bodies_in_world, const PingPlan& plan,
                                      const PingScalars& scalars);

}  // namespace sonar
