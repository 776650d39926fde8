#include "core/pipeline/scatter.hpp"

#include <algorithm>
#include <cmath>

#include "core/pipeline/arithmetic/beam_pattern.hpp"
#include "core/pipeline/arithmetic/scattering.hpp"
#include "core/pipeline/bubbles.hpp"
#include "core/scene/cells/cell_lattice.hpp"

namespace sonar {
namespace {

/// 1 / length of a ramp [1/m]. A ramp of length 0 becomes a step.
float per_metre(float from, float to) { return to > from ? 1.0f / (to - from) : 1e9f; }

PreparedTile prepare(const PingContext& context, const TileInView& t, const Rotation& seen_from_object,
                     const BubbleLayer& bubbles, float turned_away) {
  const PingScalars& s = context.scalars;
  PreparedTile out;
  simd::TileSeen& seen = out.seen;
  const CellTile& tile = *t.tile;
  // The tile's position at the time of scattering and the axes of reception are the same for all its cells.
  const EchoGeometry at = s.echo_geometry(t.from_sonar_m);
  const Rotation sonar_from_object = s.moves ? at.turn * seen_from_object : seen_from_object;
  const Vec3d from_sonar_object_m =
      s.moves ? t.from_sonar_object_m - transposed(seen_from_object) * at.moved_m : t.from_sonar_object_m;
  // This value is computed in double. Cells add a difference in float to it (docs/acoustics.md, section 1).
  const double range = length(at.from_sonar_m);
  seen.tile = &tile;
  const Vec3 q = to_float(from_sonar_object_m), p = to_float(at.from_sonar_m);
  seen.from_sonar_object[0] = q.x, seen.from_sonar_object[1] = q.y, seen.from_sonar_object[2] = q.z;
  seen.from_sonar[0] = p.x, seen.from_sonar[1] = p.y, seen.from_sonar[2] = p.z;
  for (int i = 0; i < 9; ++i) seen.turn[i] = static_cast<float>(sonar_from_object.m[i / 3][i % 3]);
  seen.range_m = static_cast<float>(range);
  // Eq. 12: phase of the tile's centre in turns, [0, 1).
  seen.phase_turns = static_cast<float>(fraction_of_turn(range * s.turns_per_m));
  // Eq. 27 for the tile's middle: delay in samples.
  seen.sample_shift = static_cast<float>(s.doppler_samples(at.from_sonar_m));
  const LawTable& law = context.laws[static_cast<std::size_t>(tile.material)];
  seen.law = law.table();
  // The factors of eq. 6 (docs/acoustics.md, section 3) that are constant over a tile: 10^(SL/20) sqrt(mu) e^{-2 a r}.
  // scatter_cells (simd/cells.inl) applies the factors of each cell: its range, incidence, pattern and phase.
  double constant = s.source_upa * std::sqrt(law.mu) * std::exp(-2 * s.absorption_np_per_m * range);
  // Bubbles (eq. 16): e^{-2 b l}, where l is the part of the straight path inside the layer, computed once for the tile's
  // middle.
  if (bubbles.present()) {
    const Vec3d seen_at = t.from_sonar_m + seen_from_object * tile.middle_cell_m();
    const double sonar_z_m = s.seen_from.position_m.z;
    constant *= bubbles.two_way(sonar_z_m, sonar_z_m + (s.world_from_sonar * seen_at).z, length(seen_at));
  }
  seen.amplitude = static_cast<float>(constant * static_cast<double>(tile.weight_unit));
  // In expected power the edge of a cell [m], the root of its area, replaces the weight, because the mean of |xi|^2 is 1.
  seen.area_amplitude = static_cast<float>(constant * lattice::cell_size_m(tile.level));
  // Levels cross-fade over 15 % of the range (docs/acoustics.md, section 3).
  seen.fade_in_from_m = t.level->fade_in_from_m;
  seen.fade_in_per_m = per_metre(t.level->fade_in_from_m, t.level->full_from_m);
  seen.fade_out_to_m = t.level->fade_out_to_m;
  seen.fade_out_per_m = per_metre(t.level->full_to_m, t.level->fade_out_to_m);

  const Fan& fan = context.plan.fan;
  seen.in_side_lobes = t.in_side_lobes;
  seen.from_tangent = t.in_side_lobes ? fan.axis.edge_tangent : 0;
  seen.to_tangent = t.in_side_lobes ? fan.tangent.back() : fan.axis.edge_tangent;
  // In the side lobes rays are sparse, so the depth map is less accurate.
  seen.tolerance_share = t.in_side_lobes ? 0.1f : 0;
  seen.turned_away = turned_away;
  seen.mark = surface_mark(static_cast<std::uint32_t>(t.object));
  seen.moves = s.moves;
  if (s.moves) {
    // The rotation from the axes of reception to the axes in which rays were traced.
    const Rotation back = transposed(at.turn);
    for (int i = 0; i < 9; ++i) seen.seen_turn[i] = static_cast<float>(back.m[i / 3][i % 3]);
    const Vec3 moved = to_float(at.moved_m);
    seen.seen_place[0] = moved.x, seen.seen_place[1] = moved.y, seen.seen_place[2] = moved.z;
  }
  find_reach(context, sonar_from_object, at.from_sonar_m, seen_from_object, t.from_sonar_m, out);
  return out;
}

/// Prefetches the cells of a tile. Tiles lie anywhere in memory, so the hardware prefetcher cannot predict their addresses.
void fetch_cells(const CellTile& tile) {
  constexpr std::size_t cache_line = 64;
  const auto* at = reinterpret_cast<const char*>(tile.data.get());
  for (std::size_t byte = 0; byte < tile.bytes(); byte += cache_line) __builtin_prefetch(at + byte);
}

}  // namespace

std::vector<float> turned_away_of(const Scene& scene, std::span<const Skin> skins, std::span<const Pose> bodies_in_world,
                                  Vec3d sonar_m) {
  constexpr std::size_t most_triangles = 5000;  // for larger meshes, a sonar in the box of an object counts as inside the object
  std::vector<float> away;
  for (std::size_t o = 0; o < scene.objects.size(); ++o) {
    const Skin& skin = skins[o];
    away.push_back(static_cast<float>(skin.outward));
    if (skin.outward == 0) continue;
    const Object& object = scene.objects[o];
    const Vec3d p = transform(inverse(scene.in_world(object, bodies_in_world)), sonar_m);
    const bool in_box = p.x >= skin.low.x && p.x <= skin.high.x && p.y >= skin.low.y && p.y <= skin.high.y && p.z >= skin.low.z &&
                        p.z <= skin.high.z;
    if (in_box && (object.mesh->triangles.size() > most_triangles || encloses(*object.mesh, p))) away.back() = 0;
  }
  return away;
}

/// Makes one table for each material, at this ping's frequency and sound speed.
std::vector<LawTable> laws_of(const Scene& scene, const PingPlan& plan, const PingScalars& s) {
  std::vector<LawTable> laws;
  for (const Material& m : scene.materials)
    laws.push_back(make_law(m, static_cast<double>(plan.mode.centre_hz), s.sound_speed_mps, plan.switches.specular));
  return laws;
}

void prepare_tiles(const PingContext& context, const std::vector<TileInView>& in_view,
                   std::span<const Rotation> sonar_from_object, std::vector<PreparedTile>& tiles) {
  const BubbleLayer bubbles(context.scene().sea_surface);
  tiles.resize(in_view.size());
  // Number of tiles of a task. Each task writes its own elements. Therefore the order of tiles, and of each sum, does not
  // depend on threads.
  constexpr std::size_t batch = 256;
  context.pool.for_each((in_view.size() + batch - 1) / batch, [&](std::size_t b, int) {
    const std::size_t end = std::min(in_view.size(), (b + 1) * batch);
    for (std::size_t i = b * batch; i < end; ++i) {
      const auto object = static_cast<std::size_t>(in_view[i].object);
      tiles[i] = prepare(context, in_view[i], sonar_from_object[object], bubbles, context.turned_away[object]);
    }
  });
}

simd::GroupView make_group_view(const PingPlan& plan, const PingScalars& s, const DepthMap& seen, int first, int last) {
  simd::GroupView g{};
  g.conical = plan.switches.conical;
  // Column k holds the directions u in [first_edge - (k + 1) du, first_edge - k du).
  g.first_edge_sine = static_cast<float>(plan.columns.first_sine + plan.columns.spacing / 2);
  g.columns_per_sine = static_cast<float>(1 / plan.columns.spacing);
  g.first_column = first;
  g.last_column = last;
  g.map_first_column = seen.first_column;
  g.fan_columns = plan.columns.count;
  g.columns_beside = s.columns_turned(plan);
  g.axis = plan.fan.axis;
  g.bins = seen.bins;
  g.inverse_depth = seen.inverse_x.data();
  g.depth_slope = seen.per_column.data();
  g.has_upper_marks = seen.has_upper_marks;
  g.depth_tolerance_m = plan.depth_tolerance_m();
  g.turns_per_m = static_cast<float>(s.turns_per_m);
  g.decay_per_m = static_cast<float>(2 * s.absorption_np_per_m);
  // Echoes whose pulse has no sample in the record are dropped: those that lie more than half of the taps beyond its ends.
  g.samples_per_m = static_cast<float>(s.samples_per_m);
  g.sample_offset = static_cast<float>(s.sample_offset);
  g.first_sample = static_cast<float>(-plan.taps / 2);
  g.last_sample = static_cast<float>(plan.samples + plan.taps / 2 - 1);
  std::copy(plan.elevation.begin(), plan.elevation.end(), g.elevation);
  g.elevation_aperture = static_cast<float>(elevation_aperture_in_wavelengths(plan.mode.pattern));
  g.expected_power = plan.expected_power;
  return g;
}

void sort_tiles(const std::vector<PreparedTile>& tiles, std::span<const ColumnRange> groups,
                std::vector<std::vector<std::uint32_t>>& by_group) {
  by_group.resize(groups.size());
  // A tile that overlaps several groups is in the list of each group. The lists keep the order of the tiles.
  for (auto& wanted : by_group) wanted.clear();
  for (std::size_t i = 0; i < tiles.size(); ++i) {
    const PreparedTile& tile = tiles[i];
    const auto ends_before = [](int column, const ColumnRange& group) { return column < group.last; };
    const auto from = std::upper_bound(groups.begin(), groups.end(), tile.first_column, ends_before);
    for (auto g = static_cast<std::size_t>(from - groups.begin()); g < groups.size() && groups[g].first < tile.last_column; ++g)
      by_group[g].push_back(static_cast<std::uint32_t>(i));
  }
}

std::size_t scatter(const std::vector<PreparedTile>& tiles, std::span<const std::uint32_t> wanted, std::size_t from,
                    const simd::GroupView& group, const simd::Kernels& kernels, Echoes& echoes) {
  for (; from < wanted.size(); ++from) {
    if (from + 2 < wanted.size()) __builtin_prefetch(tiles[wanted[from + 2]].seen.tile);
    if (from + 1 < wanted.size()) fetch_cells(*tiles[wanted[from + 1]].seen.tile);
    const simd::TileSeen& seen = tiles[wanted[from]].seen;
    // Kernels write the echoes of a tile without bounds checks. Therefore a buffer without enough room must be summed first.
    if (echoes.count + seen.tile->count > echoes.capacity()) {
      if (echoes.count > 0) break;
      echoes.reserve(seen.tile->count);
    }
    const int written = kernels.scatter_tile(seen, group, echoes.at(echoes.count));
    echoes.count += written;
    if (echoes.keeps_power && written > 0) echoes.runs.push_back({wanted[from], echoes.count});
  }
  return from;
}

std::vector<PointEcho> scatter_points(const PingContext& context) {
  const RayScene& scene = context.rays;
  const PingScalars& s = context.scalars;
  std::vector<PointEcho> points;
  const Pose world_in_sonar = inverse(s.seen_from);
  auto instance = static_cast<std::uint32_t>(scene.scene().objects.size());
  for (const PointTarget& target : scene.scene().point_targets) {
    const Vec3d in_world = scene.scene().in_world(target, context.bodies_in_world);
    const Vec3d seen = transform(world_in_sonar, in_world);
    ++instance;
    // Inside the housing 1 / r^2 does not apply. The array receives nothing from directions behind it.
    if (length(seen) < nearest_scatterer_m || seen.x <= 0) continue;
    const double strength = amplitude_from_db(static_cast<double>(target.target_strength_db));
    std::optional<PointEcho> echo = point_echo(seen, strength, context.plan, s);
    if (!echo) continue;
    echo->instance = instance;
    if (!is_occluded(scene, s.seen_from.position_m, in_world)) points.push_back(*echo);
  }
  return points;
}

std::optional<PointEcho> point_echo(Vec3d from_sonar_m, std::complex<double> strength_m, const PingPlan& plan,
                                    const PingScalars& s) {
  // Eq. 6 for one scatterer: sqrt(sigma_b A_c) is replaced by |strength|, which is 10^(TS/20) for a point.
  const Vec3d p = s.echo_geometry(from_sonar_m).from_sonar_m;
  const double r = length(p);
  // Eq. 29 has moved the point; eq. 27 shifts the echo of a sweep.
  const double at_sample = s.sample_of(r) + s.doppler_samples(p);
  if (r < nearest_scatterer_m || at_sample <= -plan.taps / 2 || at_sample >= plan.samples + plan.taps / 2 - 1) return {};
  const ConicalDirection direction = plan.direction_of(p);
  const std::optional<std::size_t> column = plan.column_of(direction, plan.fan.reach_rad);
  if (!column) return {};
  // 10^(SL/20) e^{-2 a r} / r^2 D_v T [uPa per m]. The phase is that of eq. 12.
  const double transmit = static_cast<double>(plan.columns.transmit[*column]);
  const double amplitude = s.source_upa * two_way_transmission(r, s.absorption_np_per_m) *
                           elevation_two_way(plan.mode.pattern, direction.psi_rad) * transmit;
  return PointEcho{direction.u, at_sample, strength_m * std::polar(amplitude, -2 * pi * fraction_of_turn(r * s.turns_per_m))};
}

}  // namespace sonar
