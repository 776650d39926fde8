#include "core/pipeline/simulate.hpp"

#include <algorithm>

namespace sonar {
namespace {

constexpr int group_columns = 48;   // columns one worker carries from rays to sums: their signals stay in the second cache
constexpr int window_samples = 64;  // samples one worker carries from coupling to codes
constexpr int echo_room = 16384;

int groups_of(const PingPlan& plan) { return (plan.columns.count + group_columns - 1) / group_columns; }

/// Adds the time since it was made, or last told, to a stage.
class Stopwatch {
 public:
  Stopwatch(double (*now_s)(), PingStatistics& statistics)
      : now_s_(now_s), statistics_(statistics), since_(now_s ? now_s() : 0) {}
  void lap(Stage stage) {
    if (!now_s_) return;
    const double now = now_s_();
    statistics_.seconds[static_cast<std::size_t>(stage)] += now - since_;
    since_ = now;
  }

 private:
  double (*now_s_)();
  PingStatistics& statistics_;
  double since_;
};

std::span<const Pose> bodies_of(const PingRequest& request, const Scene& scene) {
  return request.bodies_in_world.empty() ? std::span<const Pose>(scene.bodies_in_world)
                                         : std::span<const Pose>(request.bodies_in_world);
}

void find_tiles(SurfaceCells& cells, const Scene& scene, const PingRequest& request, const PingScalars& scalars, Workspace& w,
                Parallel& pool) {
  Stopwatch watch(w.now_s, w.statistics);
  const PingPlan& plan = w.plan;
  CellView view;
  view.sonar_in_world = request.sonar_in_world;
  view.bodies_in_world = bodies_of(request, scene);
  view.max_range_m = static_cast<float>(scalars.max_range_m);
  view.max_sine = static_cast<float>(std::min(1.0, plan.columns.first_sine + plan.columns.spacing));
  view.max_elevation_rad = static_cast<float>(plan.fan.half_angle_rad);
  view.levels = plan.levels;
  const auto& in_view = cells.in_view(view, pool);
  watch.lap(cells.built_last_time() > 0 ? Stage::build_cells : Stage::cull);
  prepare_tiles(in_view, cells, scene, plan, scalars, pool, w.tiles);
  sort_tiles(w.tiles, group_columns, groups_of(plan), w.tiles_by_group);
  watch.lap(Stage::cull);
  w.statistics.tiles = in_view.size();
  w.statistics.tiles_built = cells.built_last_time();
  w.statistics.cell_bytes = cells.cached_bytes();
  for (const TileInView& t : in_view) w.statistics.cells += static_cast<std::size_t>(t.tile->count);
}

void sound_fixed_fan(const RayScene& scene, const PingRequest& request, const PingScalars& scalars, const simd::Kernels& kernels,
                     int first, int last, Workspace& w, Workspace::PerWorker& mine, Stopwatch& watch) {
  mine.hits.clear();
  trace_fixed_fan(scene, w.plan, scalars, first, last, w.plan.fixed_fan, mine.hits);
  mine.statistics.rays += static_cast<std::size_t>(last - first) * static_cast<std::size_t>(w.plan.fixed_fan);
  watch.lap(Stage::trace);
  scatter_hits(mine.hits, scene.scene(), w.plan, scalars, request.seed, mine.echoes);
  mine.statistics.echoes += static_cast<std::size_t>(mine.echoes.count);
  watch.lap(Stage::scatter);
  synthesize(mine.echoes, w.plan.pulse(), kernels, w.columns);
  watch.lap(Stage::synthesize);
}

void sound_cells(const RayScene& scene, const PingScalars& scalars, const simd::Kernels& kernels, int first, int last,
                 Workspace& w, Workspace::PerWorker& mine, Stopwatch& watch) {
  mine.statistics.rays += trace_fan(scene, w.plan, scalars, first, last, mine.fan, mine.seen);
  watch.lap(Stage::trace);
  const simd::GroupView group = make_group_view(w.plan, scalars, mine.seen);
  const auto& wanted = w.tiles_by_group[static_cast<std::size_t>(first / group_columns)];
  for (std::size_t next = 0; next < wanted.size();) {
    next = scatter(w.tiles, wanted, next, group, kernels, mine.echoes);
    mine.statistics.echoes += static_cast<std::size_t>(mine.echoes.count);
    watch.lap(Stage::scatter);
    synthesize(mine.echoes, w.plan.pulse(), kernels, w.columns);
    watch.lap(Stage::synthesize);
  }
}

/// From rays to the signals of columns [first, last): one worker's share.
void sound_group(const RayScene& scene, const PingRequest& request, const PingScalars& scalars, const simd::Kernels& kernels,
                 int first, int last, Workspace& w, Workspace::PerWorker& mine) {
  Stopwatch watch(w.now_s, mine.statistics);
  clear_columns(w.columns, first, last);
  if (!request.blank) {
    if (w.plan.fixed_fan > 0)
      sound_fixed_fan(scene, request, scalars, kernels, first, last, w, mine, watch);
    else
      sound_cells(scene, scalars, kernels, first, last, w, mine, watch);
  }
  finish_columns(w.plan, request.switches.noise ? &w.noise : nullptr, request.sonar_id,
                 static_cast<std::uint32_t>(request.number), first, last, w.columns);
  watch.lap(Stage::noise);
}

/// From columns to samples of rows [first_row, last_row): one worker's share.
void image_rows(const simd::Kernels& kernels, int first_row, int last_row, Workspace& w, Workspace::PerWorker& mine, Ping& ping) {
  Stopwatch watch(w.now_s, mine.statistics);
  const int per_row = w.plan.settings.samples_per_row;
  couple(w.columns, w.plan.coupling, kernels, first_row * per_row, (last_row - first_row) * per_row, w.plan.settings.beam_count,
         mine.couple, mine.beams);
  add_points(w.points, w.plan, mine.beams);
  watch.lap(Stage::couple);
  receive(mine.beams, w.plan, kernels, mine.receive, ping);
  watch.lap(Stage::receive);
}

void gather_statistics(Workspace& w) {
  for (const Workspace::PerWorker& worker : w.workers) {
    for (std::size_t s = 0; s < w.statistics.seconds.size(); ++s) w.statistics.seconds[s] += worker.statistics.seconds[s];
    w.statistics.rays += worker.statistics.rays;
    w.statistics.echoes += worker.statistics.echoes;
  }
}

void prepare(const PingRequest& request, Workspace& w, int threads) {
  if (!w.has_plan || !serves(w.plan, request)) {
    w.plan = make_plan(request.model->modes[static_cast<std::size_t>(request.settings.mode)], request.settings, request.switches);
    w.has_plan = true;
    w.columns.shape(w.plan.columns.count, w.plan.samples, w.plan.taps);
  }
  if (request.switches.noise && !w.plan.expected_power) w.noise.prepare(request.seed, w.plan.noise_filter);
  w.workers.resize(static_cast<std::size_t>(threads));
  w.statistics = {};
  for (Workspace::PerWorker& worker : w.workers) {
    worker.statistics = {};
    if (worker.echoes.column.empty()) worker.echoes.reserve(echo_room);
  }
}

}  // namespace

Ping simulate(const RayScene& scene, SurfaceCells& cells, const PingRequest& request, const simd::Kernels& kernels, Workspace& w,
              Parallel& pool) {
  prepare(request, w, pool.threads());
  const PingScalars scalars = make_scalars(w.plan, request, scene.origin());
  w.tiles.clear();
  w.points.clear();
  if (!request.blank) {
    if (w.plan.fixed_fan == 0) find_tiles(cells, scene.scene(), request, scalars, w, pool);
    w.points = scatter_points(scene, bodies_of(request, scene.scene()), w.plan, scalars, request.sonar_in_world);
  }

  const int columns = w.plan.columns.count;
  pool.for_each(static_cast<std::size_t>(groups_of(w.plan)), [&](std::size_t g, int worker) {
    const int first = static_cast<int>(g) * group_columns;
    sound_group(scene, request, scalars, kernels, first, std::min(first + group_columns, columns), w,
                w.workers[static_cast<std::size_t>(worker)]);
  });

  Ping ping;
  ping.request = request;
  shape_ping(w.plan, request.switches, ping);
  const int rows = w.plan.settings.range_bin_count, rows_at_once = std::max(1, window_samples / w.plan.settings.samples_per_row);
  pool.for_each(static_cast<std::size_t>((rows + rows_at_once - 1) / rows_at_once), [&](std::size_t t, int worker) {
    const int first = static_cast<int>(t) * rows_at_once;
    image_rows(kernels, first, std::min(first + rows_at_once, rows), w, w.workers[static_cast<std::size_t>(worker)], ping);
  });
  gather_statistics(w);
  return ping;
}

}  // namespace sonar
