#include "core/pipeline/multipath/multipath.hpp"

#include <algorithm>

namespace sonar {
namespace {

constexpr std::size_t tiles_a_batch = 16;
constexpr std::size_t batches_a_round = 64;  // echoes of one round wait in memory, then are summed

std::vector<Leg> legs_that_see(const std::vector<FlatMirror>& mirrors, const BounceMap& map) {
  std::vector<Leg> legs{leg_by(mirrors, -1)};
  const int n = static_cast<int>(mirrors.size());
  for (int a = 0; a < n; ++a)
    for (int b = -1; b < n; ++b)
      if (const Leg leg = leg_by(mirrors, a, b); a != b && !map.owns_nothing(leg)) legs.push_back(leg);
  return legs;
}

/// Cells wherever a way by mirrors may reach; their sizes follow the ways' lengths, reach[0] being the straight one.
CellView view_of(const PingPlan& plan, const PingScalars& s, std::span<const Pose> bodies, const std::vector<LegReach>& reach) {
  CellView view;
  view.sonar_in_world = s.seen_from;
  view.bodies_in_world = bodies;
  view.max_range_m = static_cast<float>(s.max_range_m);
  view.levels = plan.levels;
  view.seen_between = [&reach](Vec3d from_sonar_m, double radius_m) {
    std::optional<DistanceSpan> all;
    const auto join = [&](const LegReach& r) {
      const std::optional<DistanceSpan> one = r.seen_between(from_sonar_m, radius_m);
      if (!one) return;
      if (!all) all = one;
      all->nearest_m = std::min(all->nearest_m, one->nearest_m);
      all->farthest_m = std::max(all->farthest_m, one->farthest_m);
    };
    for (std::size_t l = 1; l < reach.size(); ++l) join(reach[l]);
    if (all) join(reach[0]);
    return all;
  };
  return view;
}

/// In rounds: batches of tiles become echoes, sorted by column group; then groups sum them, batch by batch. So the order of
/// every sum is that of the tiles, whoever does the work.
class Rounds {
 public:
  Rounds(MultipathWork& work, const PingPlan& plan, const simd::Kernels& kernels, Parallel& pool)
      : work_(work), plan_(plan), kernels_(kernels), pool_(pool) {
    groups_ = static_cast<std::size_t>((plan.columns.count + GhostScatterer::group_columns - 1) / GhostScatterer::group_columns);
    work.batches.resize(batches_a_round);
    for (auto& batch : work.batches) batch.resize(groups_);
    work.spectral.resize(groups_);
    if (!plan.spectral) return;
    for (std::size_t g = 0; g < groups_; ++g) plan.spectral->begin(first_column(g + 1) - first_column(g), work.spectral[g]);
  }

  std::size_t run(std::vector<GhostScatterer>& scatterers, const std::vector<TileInView>& tiles) {
    std::size_t echoes = 0;
    for (std::size_t first = 0; first < tiles.size(); first += tiles_a_batch * batches_a_round) {
      const std::size_t here = std::min(tiles.size() - first, tiles_a_batch * batches_a_round);
      const std::size_t batches = (here + tiles_a_batch - 1) / tiles_a_batch;
      pool_.for_each(batches, [&](std::size_t b, int worker) {
        const std::size_t from = first + b * tiles_a_batch, to = std::min(from + tiles_a_batch, tiles.size());
        for (std::size_t t = from; t < to; ++t) scatterers[static_cast<std::size_t>(worker)].sound(tiles[t], work_.batches[b]);
      });
      for (std::size_t b = 0; b < batches; ++b)
        for (const Echoes& e : work_.batches[b]) echoes += static_cast<std::size_t>(e.count);
      pool_.for_each(groups_, [&](std::size_t g, int) {
        for (std::size_t b = 0; b < batches; ++b) sum_pulses(work_.batches[b][g], g);
      });
    }
    if (plan_.spectral)
      pool_.for_each(groups_, [&](std::size_t g, int) {
        plan_.spectral->finish(first_column(g), first_column(g + 1), work_.spectral[g], work_.columns);
      });
    return echoes;
  }

 private:
  int first_column(std::size_t group) const {
    return std::min(static_cast<int>(group) * GhostScatterer::group_columns, plan_.columns.count);
  }
  void sum_pulses(Echoes& echoes, std::size_t group) {
    if (plan_.spectral)
      plan_.spectral->add(echoes, first_column(group), work_.spectral[group]);
    else
      synthesize(echoes, plan_.pulse(), kernels_, work_.columns);
  }

  MultipathWork& work_;
  const PingPlan& plan_;
  const simd::Kernels& kernels_;
  Parallel& pool_;
  std::size_t groups_ = 0;
};

}  // namespace

MultipathCounts sound_ghosts(const RayScene& scene, SurfaceCells& cells, std::span<const Pose> bodies,
                             const std::vector<LawTable>& laws, const PingPlan& plan, const PingScalars& s,
                             const simd::Kernels& kernels, Parallel& pool, MultipathWork& work, std::vector<PointEcho>& points) {
  work.heard = false;
  if (!work.faces_found) {
    work.faces = find_flat_faces(scene.scene(), least_reflectance);
    work.faces_found = true;
  }
  Ways& ways = work.ways;
  ways.bubbles = BubbleLayer(scene.scene().sea_surface);
  ways.mirrors = mirrors_of(work.faces, scene.scene(), bodies, plan, s);
  MultipathCounts counts;
  if (ways.mirrors.empty()) return counts;
  counts.rays = trace_bounces(scene, plan, s, work.faces, ways.mirrors, pool, ways.map);
  ways.legs = legs_that_see(ways.mirrors, ways.map);
  ghosts_of_points(scene, bodies, work.faces, ways, plan, s, points);
  if (ways.legs.size() == 1) return counts;

  std::vector<LegReach> reach;
  for (const Leg& leg : ways.legs) reach.emplace_back(leg, ways, plan, s);
  const CellView view = view_of(plan, s, bodies, reach);
  const std::vector<TileInView>& tiles = cells.in_view(view, pool);
  const std::vector<float> correlation = plan.expected_power ? beam_correlation_over_columns(plan) : std::vector<float>{};
  std::vector<GhostScatterer> scatterers;
  for (int worker = 0; worker < pool.threads(); ++worker) scatterers.emplace_back(ways, reach, cells, laws, correlation, plan, s);
  work.columns.shape(plan.columns.count, plan.samples, plan.taps);
  clear_columns(work.columns, 0, plan.columns.count);
  counts.echoes = Rounds(work, plan, kernels, pool).run(scatterers, tiles);
  work.heard = counts.echoes > 0;
  return counts;
}

void add_ghosts(const MultipathWork& work, int first, int last, ColumnSignals& signals) {
  if (!work.heard) return;
  const std::ptrdiff_t from = first * signals.stride, to = last * signals.stride;
  for (std::ptrdiff_t i = from; i < to; ++i)
    signals.data[static_cast<std::size_t>(i)] += work.columns.data[static_cast<std::size_t>(i)];
}

}  // namespace sonar
