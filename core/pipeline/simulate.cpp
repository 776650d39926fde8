#include "core/pipeline/simulate.hpp"

#include <algorithm>

namespace sonar {
namespace {

constexpr int most_traced_columns = 48;  // columns whose rays are refined together
constexpr std::size_t group_bytes =
    640 << 10;                            // signals and depth maps one worker carries from rays to sums: in the second cache
constexpr int least_groups_a_worker = 3;  // so that all are done at about the same time
constexpr int window_samples = 64;        // samples one worker carries from coupling to codes
constexpr int echo_room = 16384;
constexpr std::size_t most_prepared = 8;  // sets of settings kept ready

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

PreparedSettings& prepared_for(const PingRequest& request, const Scene& scene, Workspace& w) {
  ++w.pings;
  auto it = std::find_if(w.prepared.begin(), w.prepared.end(),
                         [&](const auto& p) { return p->model == request.model && serves(p->plan, request); });
  if (it == w.prepared.end()) {
    if (w.prepared.size() >= most_prepared)
      w.prepared.erase(std::min_element(w.prepared.begin(), w.prepared.end(),
                                        [](const auto& a, const auto& b) { return a->last_used < b->last_used; }));
    auto made = std::make_unique<PreparedSettings>();
    made->model = request.model;
    made->plan =
        make_plan(request.model->modes[static_cast<std::size_t>(request.settings.mode)], request.settings, request.switches);
    it = w.prepared.insert(w.prepared.end(), std::move(made));
  }
  PreparedSettings& p = **it;
  p.last_used = w.pings;
  set_gain(p.plan, request.settings.gain_db);
  const bool volume = request.switches.volume && scene.water_column.has_volume();
  const bool leak = request.switches.leak && p.plan.mode.receiver.leak_upa > 0;
  if ((request.switches.noise || leak || volume) && !p.plan.expected_power) p.noise.prepare(request.seed, p.plan.noise_filter);
  return p;
}

/// The stages of one ping and what they hand on.
class PingUnderWay {
 public:
  PingUnderWay(const RayScene& scene, SurfaceCells& cells, const PingRequest& request, const simd::Kernels& kernels,
               Workspace& work, Parallel& pool)
      : scene_(scene),
        cells_(cells),
        request_(request),
        kernels_(kernels),
        w_(work),
        pool_(pool),
        prepared_(prepared_for(request, scene.scene(), work)),
        plan_(prepared_.plan),
        scalars_(make_scalars(plan_, request, scene.origin())),
        volume_(scene.scene().water_column, plan_, scalars_),
        leak_(plan_, request.switches),
        crosstalk_(plan_, request.switches),
        bodies_(request.bodies_in_world.empty() ? scene.scene().bodies_in_world : request.bodies_in_world) {
    w_.columns.shape(plan_.columns.count, plan_.samples, plan_.taps);
    group_columns_ = group_columns();
    w_.workers.resize(static_cast<std::size_t>(pool.threads()));
    w_.statistics = {};
    w_.first_hits.assign(request.switches.keep_truth ? static_cast<std::size_t>(plan_.columns.count) : 0, BeamTruth{});
    for (Workspace::PerWorker& worker : w_.workers) {
      worker.statistics = {};
      if (worker.echoes.column.empty()) worker.echoes.reserve(echo_room);
    }
  }

  void find_echo_sources();
  void hear_by_mirrors();
  void sound_columns();
  Ping image();

 private:
  bool ray_is_scatterer() const { return plan_.fixed_fan > 0; }
  /// As even as may be, so that no group is left over that is small.
  int traced_columns() const {
    const int parts = (plan_.columns.count + most_traced_columns - 1) / most_traced_columns;
    return (plan_.columns.count + parts - 1) / parts;
  }
  int group_columns() const;
  int groups() const { return (plan_.columns.count + group_columns_ - 1) / group_columns_; }
  void sound_group(int first, int last, Workspace::PerWorker& mine);
  void scatter_hits_of(int first, int last, Workspace::PerWorker& mine, Stopwatch& watch);
  void scatter_cells_of(int first, int last, Workspace::PerWorker& mine, Stopwatch& watch);
  void sum_pulses(int first, Workspace::PerWorker& mine);
  void image_rows(int first, int last, Workspace::PerWorker& mine, Ping& ping);

  const RayScene& scene_;
  SurfaceCells& cells_;
  const PingRequest& request_;
  const simd::Kernels& kernels_;
  Workspace& w_;
  Parallel& pool_;
  PreparedSettings& prepared_;
  const PingPlan& plan_;
  PingScalars scalars_;
  Volume volume_;
  Leak leak_;
  Crosstalk crosstalk_;
  std::span<const Pose> bodies_;
  int group_columns_ = 0;
  std::vector<PointEcho> points_;
  std::vector<PulseHeard> other_sonars_;
};

/// How many columns a worker takes at once. Tiles that reach into several groups are looked at by each, so the more the better,
/// as far as caches and workers allow. No result depends on it: a column's echoes are summed in the order of the tiles.
int PingUnderWay::group_columns() const {
  const int traced = traced_columns();
  if (w_.between && w_.between->expected()) return traced;
  const int bins = ray_is_scatterer() ? 0 : plan_.fan.bins;
  const auto column_bytes = sizeof(float) * (static_cast<std::size_t>(w_.columns.stride) + static_cast<std::size_t>(bins));
  const int in_cache = static_cast<int>(group_bytes / column_bytes);
  const int least_groups = pool_.threads() > 1 ? least_groups_a_worker * pool_.threads() : 1;
  const int for_all = (plan_.columns.count + least_groups - 1) / least_groups;
  if (ray_is_scatterer()) return std::max(1, std::min({in_cache, for_all, traced}));
  return std::max(1, std::min(in_cache / traced, (for_all + traced - 1) / traced)) * traced;
}

/// Surface cells that may be in view, sorted by the columns they reach; analytic points that are.
void PingUnderWay::find_echo_sources() {
  if (request_.blank) return;
  points_ = scatter_points(scene_, bodies_, plan_, scalars_);
  other_sonars_ = hear_other_sonars(scene_, plan_, scalars_, request_);
  Stopwatch watch(w_.now_s, w_.statistics);
  if (request_.switches.specular) w_.mirror_echoes.find(scene_, bodies_, plan_, scalars_, points_);
  watch.lap(Stage::specular);
  w_.laws = laws_of(scene_.scene(), plan_, scalars_);
  if (ray_is_scatterer()) return;
  if (request_.switches.multipath) hear_by_mirrors();
  watch.lap(Stage::multipath);
  CellView view;
  view.sonar_in_world = scalars_.seen_from;
  view.bodies_in_world = bodies_;
  view.max_range_m = static_cast<float>(scalars_.max_range_m);
  view.max_sine = static_cast<float>(std::min(1.0, plan_.columns.first_sine + plan_.columns.spacing));
  view.max_elevation_rad = static_cast<float>(plan_.widest_about_axis_rad());
  view.levels = plan_.levels;
  const std::vector<TileInView>& in_view = cells_.in_view(view, pool_);
  watch.lap(cells_.built_last_time() > 0 ? Stage::build_cells : Stage::cull);
  prepare_tiles(in_view, cells_, scene_.scene(), w_.laws, plan_, scalars_, pool_, w_.tiles);
  sort_tiles(w_.tiles, group_columns_, groups(), w_.tiles_by_group);
  watch.lap(Stage::cull);
  w_.statistics.tiles = in_view.size();
  w_.statistics.tiles_built = cells_.built_last_time();
  w_.statistics.cell_bytes = cells_.cached_bytes();
  for (const TileInView& t : in_view) w_.statistics.cells += static_cast<std::size_t>(t.tile->count);
}

/// What comes by way of flat mirrors waits in columns of its own.
void PingUnderWay::hear_by_mirrors() {
  const MultipathCounts counts =
      sound_ghosts(scene_, cells_, bodies_, w_.laws, plan_, scalars_, kernels_, pool_, w_.multipath, points_);
  w_.statistics.rays += counts.rays;
  w_.statistics.echoes += counts.echoes;
}

/// Rays, echoes, pulses and noise, a group of columns at a time.
void PingUnderWay::sound_columns() {
  const auto all = static_cast<std::size_t>(groups());
  const std::size_t at_once = w_.between && w_.between->expected() ? static_cast<std::size_t>(pool_.threads()) : all;
  for (std::size_t from = 0; from < all; from += at_once) {
    if (from > 0) w_.between->take();
    pool_.for_each(std::min(at_once, all - from), [&](std::size_t g, int worker) {
      const int first = static_cast<int>(from + g) * group_columns_;
      sound_group(first, std::min(first + group_columns_, plan_.columns.count), w_.workers[static_cast<std::size_t>(worker)]);
    });
  }
}

void PingUnderWay::sound_group(int first, int last, Workspace::PerWorker& mine) {
  Stopwatch watch(w_.now_s, mine.statistics);
  const ReceiverNoise noise{request_.switches.noise ? &prepared_.noise : nullptr, request_.sonar_id,
                            static_cast<std::uint32_t>(request_.number)};
  begin_columns(plan_, noise, first, last, w_.columns);
  watch.lap(Stage::noise);
  if (plan_.spectral) plan_.spectral->begin(last - first, mine.spectral);
  if (!request_.blank) {
    if (ray_is_scatterer())
      scatter_hits_of(first, last, mine, watch);
    else
      scatter_cells_of(first, last, mine, watch);
  }
  if (plan_.spectral) plan_.spectral->finish(first, last, mine.spectral, w_.columns);
  if (request_.switches.multipath && !request_.blank && !ray_is_scatterer()) add_ghosts(w_.multipath, first, last, w_.columns);
  if (volume_.is_heard() && !request_.blank)
    volume_.add(ray_is_scatterer() ? nullptr : &mine.seen, prepared_.noise, request_.sonar_id,
                static_cast<std::uint32_t>(request_.number), first, last, mine.volume, w_.columns);
  finish_columns(plan_, noise, first, last, w_.columns);
  if (leak_.is_heard() && !request_.blank)
    leak_.add(plan_, prepared_.noise, request_.sonar_id, static_cast<std::uint32_t>(request_.number), first, last, w_.columns);
  watch.lap(Stage::noise);
}

void PingUnderWay::scatter_hits_of(int first, int last, Workspace::PerWorker& mine, Stopwatch& watch) {
  mine.hits.clear();
  trace_fixed_fan(scene_, plan_, scalars_, first, last, mine.hits);
  if (!w_.first_hits.empty()) note_first_hits(mine.hits, plan_, w_.first_hits);
  mine.statistics.rays += static_cast<std::size_t>(last - first) * static_cast<std::size_t>(plan_.fixed_fan);
  watch.lap(Stage::trace);
  scatter_hits(mine.hits, scene_.scene(), w_.laws, plan_, scalars_, request_.seed, kernels_, mine.echoes);
  mine.statistics.echoes += static_cast<std::size_t>(mine.echoes.count);
  watch.lap(Stage::scatter);
  sum_pulses(first, mine);
  watch.lap(Stage::synthesize);
}

void PingUnderWay::scatter_cells_of(int first, int last, Workspace::PerWorker& mine, Stopwatch& watch) {
  mine.seen.shape(first, last, plan_.fan.bins);
  for (int from = first; from < last; from += traced_columns()) {
    const int to = std::min(from + traced_columns(), last);
    mine.statistics.rays += trace_fan(scene_, plan_, scalars_, from, to, mine.fan, mine.seen);
    if (!w_.first_hits.empty()) note_first_hits(mine.fan, plan_, from, to, w_.first_hits);
  }
  watch.lap(Stage::trace);
  const simd::GroupView group = make_group_view(plan_, scalars_, mine.seen);
  const auto& wanted = w_.tiles_by_group[static_cast<std::size_t>(first / group_columns_)];
  for (std::size_t next = 0; next < wanted.size();) {
    next = scatter(w_.tiles, wanted, next, group, kernels_, mine.echoes);
    mine.statistics.echoes += static_cast<std::size_t>(mine.echoes.count);
    watch.lap(Stage::scatter);
    sum_pulses(first, mine);
    watch.lap(Stage::synthesize);
  }
}

/// In time where the pulse is real and tabulated, else by way of the spectrum.
void PingUnderWay::sum_pulses(int first, Workspace::PerWorker& mine) {
  if (plan_.spectral)
    plan_.spectral->add(mine.echoes, first, mine.spectral);
  else
    synthesize(mine.echoes, plan_.pulse(), kernels_, w_.columns);
}

/// Beams, envelope, gain and codes, a window of rows at a time.
Ping PingUnderWay::image() {
  Ping ping;
  ping.request = request_;
  shape_ping(plan_, request_.switches, ping);
  if (!w_.first_hits.empty()) ping.truth = truth_of_beams(plan_, w_.first_hits);
  const int rows = plan_.settings.range_bin_count, rows_at_once = std::max(1, window_samples / plan_.settings.samples_per_row);
  pool_.for_each(static_cast<std::size_t>((rows + rows_at_once - 1) / rows_at_once), [&](std::size_t window, int worker) {
    const int first = static_cast<int>(window) * rows_at_once;
    image_rows(first, std::min(first + rows_at_once, rows), w_.workers[static_cast<std::size_t>(worker)], ping);
  });
  for (const Workspace::PerWorker& worker : w_.workers) {
    for (std::size_t s = 0; s < w_.statistics.seconds.size(); ++s) w_.statistics.seconds[s] += worker.statistics.seconds[s];
    w_.statistics.rays += worker.statistics.rays;
    w_.statistics.echoes += worker.statistics.echoes;
  }
  return ping;
}

void PingUnderWay::image_rows(int first, int last, Workspace::PerWorker& mine, Ping& ping) {
  Stopwatch watch(w_.now_s, mine.statistics);
  const int per_row = plan_.settings.samples_per_row;
  couple(w_.columns, plan_.coupling, kernels_, first * per_row, (last - first) * per_row, plan_.settings.beam_count, mine.couple,
         mine.beams);
  add_points(points_, plan_, mine.beams);
  add_pulses(other_sonars_, plan_, mine.beams);
  if (crosstalk_.is_heard()) crosstalk_.add(plan_, mine.beams);
  watch.lap(Stage::couple);
  receive(mine.beams, plan_, kernels_, mine.receive, ping);
  watch.lap(Stage::receive);
}

}  // namespace

Ping simulate(const RayScene& scene, SurfaceCells& cells, const PingRequest& request, const simd::Kernels& kernels,
              Workspace& work, Parallel& pool) {
  PingUnderWay ping(scene, cells, request, kernels, work, pool);
  ping.find_echo_sources();  // scatterers live on the surfaces; speckle is theirs
  ping.sound_columns();      // trace_fan: what is visible; scatter: echoes; synthesize: pulses; receiver noise
  return ping.image();       // couple: columns to beams; receive: envelope, TVG, samples
}

}  // namespace sonar
