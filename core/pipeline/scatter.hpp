// Stage two computes the echo of each visible surface cell: its position on the sample grid, column, amplitude and carrier phase.
// The speckle is fixed to the surface. The stage also computes the echoes of the fixed fan and of point targets.
#pragma once

#include <complex>
#include <optional>
#include <span>
#include <vector>

#include "core/pipeline/hidden_tiles.hpp"
#include "core/pipeline/interleaved_pings.hpp"
#include "core/pipeline/ping_context.hpp"
#include "core/pipeline/ping_plan.hpp"
#include "core/pipeline/ping_scalars.hpp"
#include "core/pipeline/scattering_law.hpp"
#include "core/pipeline/signals.hpp"
#include "core/pipeline/simd/kernels.hpp"
#include "core/scene/cells/surface_cells.hpp"

namespace sonar {

/// The scattering law of every material of the scene, at this ping's frequency.
std::vector<LawTable> laws_of(const Scene& scene, const PingPlan& plan, const PingScalars& scalars);

/// For each object, in the order of `skins`: the sign of the normals of those surfaces that face away from a sonar at `sonar_m`
/// [m, world] and are hidden by the object itself: 1 or -1 for a closed mesh seen from outside, else 0.
std::vector<float> turned_away_of(const Scene& scene, std::span<const Skin> skins, std::span<const Pose> bodies_in_world,
                                  Vec3d sonar_m);

/// Prepares the tiles in view, in parallel, and keeps their order. The tiles refer to the laws, which must outlive them.
/// `sonar_from_object`: rotations of the view, for each object.
void prepare_tiles(const PingContext& context, const std::vector<TileInView>& in_view,
                   std::span<const Rotation> sonar_from_object, std::vector<PreparedTile>& tiles);

/// Makes the view of columns [first, last). The map may have more columns.
simd::GroupView make_group_view(const PingPlan& plan, const PingScalars& scalars, const DepthMap& seen, int first, int last);

/// For each group of columns, lists the tiles that reach into the group, in order. Groups must be in increasing order and must
/// not overlap.
void sort_tiles(const std::vector<PreparedTile>& tiles, std::span<const ColumnRange> groups,
                std::vector<std::vector<std::uint32_t>>& by_group);

/// Appends the echoes of tiles[wanted[from, ...)] until all are done or `echoes` is full; returns the next index into `wanted`.
std::size_t scatter(const std::vector<PreparedTile>& tiles, std::span<const std::uint32_t> wanted, std::size_t from,
                    const simd::GroupView& group, const simd::Kernels& kernels, Echoes& echoes);

/// Appends one echo for each hit, as in the paper: sigma = mu cos r^2 dOmega. The key of the speckle is (seed, object, column,
/// ray).
void scatter_hits(const PingContext& context, std::span<const FanHit> hits, Seed seed, Echoes& echoes);

/// The echo of a point in the axes of PingScalars::seen_from. `strength_m` [m] is its backscattering amplitude: echo pressure
/// at 1 m per incident pressure, the square root of the cross-section. It may have a phase. nullopt if the point lies outside
/// the fan or the record. The caller tests whether the point is hidden.
std::optional<PointEcho> point_echo(Vec3d from_sonar_m, std::complex<double> strength_m, const PingPlan& plan,
                                    const PingScalars& scalars);
/// Returns the echoes of point targets in the fan that no surface hides.
std::vector<PointEcho> scatter_points(const PingContext& context);

}  // namespace sonar
