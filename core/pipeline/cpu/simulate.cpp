#include "core/pipeline/cpu/simulate.hpp"

#include <algorithm>
#include <cstdint>
#include <vector>

#include "core/pipeline/form_beams.hpp"
#include "core/pipeline/interference.hpp"
#include "core/pipeline/multipath/multipath.hpp"
#include "core/pipeline/ping_context.hpp"
#include "core/pipeline/range_image.hpp"
#include "core/pipeline/receive.hpp"
#include "core/pipeline/scatter.hpp"
#include "core/pipeline/settings_cache.hpp"
#include "core/pipeline/specular/specular.hpp"
#include "core/pipeline/synthesize.hpp"
#include "core/pipeline/trace_fan.hpp"
#include "core/pipeline/truth.hpp"
#include "core/pipeline/volume.hpp"

namespace sonar {

/// Buffers reused from ping to ping.
struct Workspace::Buffers {
  SettingsCache prepared;
  SpecularEchoes specular_echoes;
  std::vector<LawTable> laws;  // tiles contain pointers into it
  std::vector<float> turned_away;
  std::vector<PreparedTile> tiles;
  std::vector<std::vector<std::uint32_t>> tiles_by_group;
  MultipathWork multipath;
  ColumnSignals columns;
  std::vector<BeamTruth> first_hits;  // by column, when switches.keep_truth
  LabelWork labels;
  struct PerWorker {
    FanScratch fan;
    DepthMap seen;
    FarthestSeen farthest;
    std::vector<std::uint32_t> in_sight;  // tiles of the group
    std::vector<FanHit> hits;
    Echoes echoes;
    VolumeScratch volume;
    SpectralScratch spectral;
    BeamScratch beam_scratch;
    BeamSignals beams;
    std::vector<float> mixed;
    ReceiveScratch receive;
    PingStatistics statistics;
  };
  std::vector<PerWorker> workers;
  PingStatistics statistics;
  double (*now_s)() = nullptr;
  Interruption* between = nullptr;
};

Workspace::Workspace(double (*now_s)()) : buffers_(std::make_unique<Buffers>()) { buffers_->now_s = now_s; }
Workspace::~Workspace() = default;
void Workspace::set_between(Interruption* between) { buffers_->between = between; }
void Workspace::change_scene() {
  buffers_->specular_echoes.forget_unused();
  buffers_->multipath = {};
}
const PingStatistics& Workspace::statistics() const { return buffers_->statistics; }

namespace {

constexpr int most_traced_columns = 48;  // largest number of columns whose rays are refined together
constexpr std::size_t group_bytes =
    640 << 10;  // signals and depth maps of a worker, which stay in the second-level cache from rays to sums
constexpr int least_groups_a_worker = 3;  // with at least this many, all workers end at about the same time
constexpr int window_samples = 64;        // samples that a worker processes from beamforming to codes
constexpr int echo_room = 16384;

/// Adds the time since its construction or since the last lap to a stage.
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

}  // namespace

/// The stages of one ping, and the data that they exchange.
class PingSimulation {
 public:
  PingSimulation(const RayScene& scene, SurfaceCells& cells, const PingRequest& request, const simd::Kernels& kernels,
                 Workspace& work, Parallel& pool, PingLabels* labels, BeamChoice beams)
      : scene_(scene),
        cells_(cells),
        request_(request),
        kernels_(kernels),
        w_(*work.buffers_),
        pool_(pool),
        labels_(labels),
        beams_(beams),
        prepared_(w_.prepared.prepared_for(request, scene.scene(), pool)),
        plan_(prepared_.plan),
        scalars_(make_scalars(plan_, request, scene.origin())),
        volume_(scene.scene().water_column, plan_, scalars_),
        leak_(plan_, request.switches),
        crosstalk_(plan_, request.switches),
        bodies_(request.bodies_in_world.empty() ? scene.scene().bodies_in_world : request.bodies_in_world),
        context_{scene, cells, bodies_, w_.laws, w_.turned_away, plan_, scalars_, kernels, pool},
        used_(columns_of(plan_, beams)) {
    // Buffers keep their memory from ping to ping; values of an earlier ping are never read.
    w_.columns.shape(plan_.columns.count, plan_.samples, plan_.taps);
    group_columns_ = group_columns();
    for (const ColumnRange& range : used_)
      for (int first = range.first; first < range.last; first += group_columns_)
        groups_.push_back({first, std::min(first + group_columns_, range.last)});
    w_.workers.resize(static_cast<std::size_t>(pool.threads()));
    w_.statistics = {};
    w_.first_hits.assign(request.switches.keep_truth ? static_cast<std::size_t>(plan_.columns.count) : 0, BeamTruth{});
    for (Workspace::Buffers::PerWorker& worker : w_.workers) {
      worker.statistics = {};
      worker.echoes.keeps_power = labels != nullptr;
      worker.echoes.reserve(std::max(worker.echoes.capacity(), echo_room));
    }
  }

  void find_echo_sources();
  void find_multipath_echoes();
  void simulate_columns();
  Ping image();

 private:
  bool ray_is_scatterer() const { return plan_.fixed_fan > 0; }
  /// Number of columns that are traced together. The parts have nearly equal sizes, so that no small part remains.
  int traced_columns() const {
    const int parts = (plan_.columns.count + most_traced_columns - 1) / most_traced_columns;
    return (plan_.columns.count + parts - 1) / parts;
  }
  int group_columns() const;
  void simulate_group(std::size_t group, Workspace::Buffers::PerWorker& mine);
  void scatter_hits_of(int first, int last, Workspace::Buffers::PerWorker& mine, Stopwatch& watch);
  void scatter_cells_of(std::size_t group, Workspace::Buffers::PerWorker& mine, Stopwatch& watch);
  void sum_pulses(int first, Workspace::Buffers::PerWorker& mine);
  void image_rows(int first, int last, Workspace::Buffers::PerWorker& mine, Ping& ping);

  const RayScene& scene_;
  SurfaceCells& cells_;
  const PingRequest& request_;
  const simd::Kernels& kernels_;
  Workspace::Buffers& w_;
  Parallel& pool_;
  PingLabels* labels_;  // null = no labels
  BeamChoice beams_;
  PreparedSettings& prepared_;
  const PingPlan& plan_;
  PingScalars scalars_;
  Volume volume_;
  Leak leak_;
  Crosstalk crosstalk_;
  std::span<const Pose> bodies_;
  const PingContext context_;
  std::vector<ColumnRange> used_;    // columns that the beams use
  std::vector<ColumnRange> groups_;  // parts of them that a worker computes at once
  int group_columns_ = 0;            // most columns of a group
  std::vector<PointEcho> points_;
  std::vector<ReceivedPulse> other_sonars_;
  std::vector<float> shared_noise_;  // noise that the channels share in this ping
};

/// The number of columns in a worker's group. Each group processes the tiles that overlap it, so larger groups need less work;
/// caches and the number of workers limit the size. No result depends on the size, because the echoes of a column are summed in
/// the order of the tiles.
int PingSimulation::group_columns() const {
  const int traced = traced_columns();
  // If a ping of another sonar is likely, groups are small, so that the other ping can run between two of them.
  const bool is_small = w_.between && w_.between->expected();
  if (is_small && !ray_is_scatterer()) return traced;
  const int bins = ray_is_scatterer() ? 0 : plan_.fan.bins;
  // Signals and depth maps of a group should fit a worker's share of the second-level cache.
  const auto column_bytes = sizeof(float) * (static_cast<std::size_t>(w_.columns.stride) + static_cast<std::size_t>(bins));
  const int in_cache = static_cast<int>(group_bytes / column_bytes);
  const int least_groups = pool_.threads() > 1 ? least_groups_a_worker * pool_.threads() : 1;
  const int for_all = (plan_.columns.count + least_groups - 1) / least_groups;
  if (ray_is_scatterer()) {
    const int most = is_small ? traced : std::min({in_cache, for_all, traced});
    return std::max(1, most / fixed_fan_columns) * fixed_fan_columns;
  }
  return std::max(1, std::min(in_cache / traced, (for_all + traced - 1) / traced)) * traced;
}

/// Finds the surface cells that may be in view, sorted by column, and the visible point echoes.
void PingSimulation::find_echo_sources() {
  if (request_.blank) return;
  // Echoes without a surface: point targets, other sonars, specular points (eq. 7).
  points_ = scatter_points(context_);
  other_sonars_ = receive_other_sonars(context_, request_);
  Stopwatch watch(w_.now_s, w_.statistics);
  if (request_.switches.specular) w_.specular_echoes.find(context_, points_);
  watch.lap(Stage::specular);
  w_.laws = laws_of(scene_.scene(), plan_, scalars_);
  if (ray_is_scatterer()) return;
  w_.turned_away = turned_away_of(scene_.scene(), cells_.skins(), bodies_, scalars_.seen_from.position_m);
  if (request_.switches.multipath) find_multipath_echoes();
  watch.lap(Stage::multipath);
  // Surface cells within the range and the fan. Their level follows from the distance.
  CellView view;
  view.sonar_in_world = scalars_.seen_from;
  view.bodies_in_world = bodies_;
  view.min_range_m = static_cast<float>(scalars_.min_range_m);
  view.max_range_m = static_cast<float>(scalars_.max_range_m);
  plan_.aim(view);
  const std::vector<TileInView>& in_view = cells_.in_view(view, pool_);
  watch.lap(cells_.built_last_time() > 0 ? Stage::build_cells : Stage::cull);
  prepare_tiles(context_, in_view, cells_.sonar_from_objects(), w_.tiles);
  sort_tiles(w_.tiles, groups_, w_.tiles_by_group);
  if (labels_) w_.labels.begin(context_, w_.tiles, w_.tiles_by_group, group_columns_);
  watch.lap(Stage::cull);
  w_.statistics.tiles = in_view.size();
  w_.statistics.tiles_built = cells_.built_last_time();
  w_.statistics.cell_bytes = cells_.cached_bytes();
  for (const TileInView& t : in_view) w_.statistics.cells += static_cast<std::size_t>(t.tile->count);
}

/// Computes echoes via flat mirrors, in column buffers of their own.
void PingSimulation::find_multipath_echoes() {
  const MultipathCounts counts = simulate_multipath(context_, w_.multipath, points_);
  w_.statistics.rays += counts.rays;
  w_.statistics.echoes += counts.echoes;
}

/// Computes rays, echoes, pulses and noise, one group of columns at a time.
void PingSimulation::simulate_columns() {
  // Runs all groups at once. If an interruption is likely, runs as many groups as there are threads between two yield points.
  const std::size_t all = groups_.size();
  const std::size_t at_once = w_.between && w_.between->expected() ? static_cast<std::size_t>(pool_.threads()) : all;
  for (std::size_t from = 0; from < all; from += at_once) {
    if (from > 0) w_.between->run_other();
    pool_.for_each(std::min(at_once, all - from),
                   [&](std::size_t g, int worker) { simulate_group(from + g, w_.workers[static_cast<std::size_t>(worker)]); });
  }
}

void PingSimulation::simulate_group(std::size_t group, Workspace::Buffers::PerWorker& mine) {
  const auto [first, last] = groups_[group];
  Stopwatch watch(w_.now_s, mine.statistics);
  // Draws depend only on (seed, sonar, ping, column). Therefore they are equal for every number of threads.
  const PingNoise draws{prepared_.one_table() ? &prepared_.noise : &prepared_.grains, request_.sonar_id,
                        static_cast<std::uint32_t>(request_.number)};
  const PingNoise noise{request_.switches.noise ? &prepared_.noise : nullptr, draws.sonar, draws.ping};
  // Order of the sums of a column: noise, echoes, multipath, volume, T(u), leak. Outside the sector the noise comes after T(u).
  begin_columns(plan_, noise, first, last, w_.columns);
  watch.lap(Stage::noise);
  if (plan_.spectral) plan_.spectral->begin(last - first, mine.spectral);
  if (!request_.blank) {
    if (ray_is_scatterer())
      scatter_hits_of(first, last, mine, watch);
    else
      scatter_cells_of(group, mine, watch);
  }
  if (plan_.spectral) plan_.spectral->finish(first, last, mine.spectral, w_.columns);
  if (request_.switches.multipath && !request_.blank && !ray_is_scatterer()) add_multipath(w_.multipath, first, last, w_.columns);
  if (volume_.is_audible() && !request_.blank)
    volume_.add(ray_is_scatterer() ? nullptr : &mine.seen, draws, first, last, mine.volume, w_.columns);
  finish_columns(plan_, noise, first, last, w_.columns);
  if (leak_.is_audible() && !request_.blank) leak_.add(plan_, draws, first, last, w_.columns);
  watch.lap(Stage::noise);
}

void PingSimulation::scatter_hits_of(int first, int last, Workspace::Buffers::PerWorker& mine, Stopwatch& watch) {
  mine.hits.clear();
  trace_fixed_fan(scene_, plan_, scalars_, first, last, mine.hits);
  if (!w_.first_hits.empty()) note_first_hits(mine.hits, plan_, w_.first_hits);
  mine.statistics.rays += static_cast<std::size_t>(last - first) * static_cast<std::size_t>(plan_.fixed_fan);
  watch.lap(Stage::trace);
  scatter_hits(context_, mine.hits, request_.seed, mine.echoes);
  mine.statistics.echoes += static_cast<std::size_t>(mine.echoes.count);
  watch.lap(Stage::scatter);
  sum_pulses(first, mine);
  watch.lap(Stage::synthesize);
}

void PingSimulation::scatter_cells_of(std::size_t number, Workspace::Buffers::PerWorker& mine, Stopwatch& watch) {
  const auto [first, last] = groups_[number];
  // If the sonar moves, an echo may be received in another column than that of its ray.
  const int beside = scalars_.columns_turned(plan_);
  const int map_first = std::max(first - beside, 0), map_last = std::min(last + beside, plan_.columns.count);
  mine.seen.shape(map_first, map_last, plan_.fan.bins);
  const auto trace = [&](int from, int to) {
    return from < to ? trace_fan(scene_, plan_, scalars_, from, to, mine.fan, mine.seen) : 0;
  };
  for (int from = first; from < last; from += traced_columns()) {
    // Rays draw the depth map of these columns (docs/acoustics.md, section 2).
    const int to = std::min(from + traced_columns(), last);
    mine.statistics.rays += trace(from, to);  // the rays of columns beside the group count in the group of those columns
    if (!w_.first_hits.empty()) note_first_hits(mine.fan, plan_, from, to, w_.first_hits);
    if (labels_) w_.labels.note_shadows(mine.fan, from, to);
  }
  trace(map_first, first);
  trace(last, map_last);
  watch.lap(Stage::trace);
  const simd::GroupView group = make_group_view(plan_, scalars_, mine.seen, first, last);
  mine.farthest.shape(mine.seen);
  mine.farthest.leave_out_hidden(w_.tiles, w_.tiles_by_group[number], group, mine.in_sight);
  if (labels_) w_.labels.begin_group(group);
  // scatter() stops when its buffer is full. The order of the tiles stays the same.
  for (std::size_t next = 0; next < mine.in_sight.size();) {
    next = scatter(w_.tiles, mine.in_sight, next, group, kernels_, mine.echoes);
    mine.statistics.echoes += static_cast<std::size_t>(mine.echoes.count);
    if (labels_) w_.labels.add_cells(group, mine.echoes);
    watch.lap(Stage::scatter);
    sum_pulses(first, mine);
    watch.lap(Stage::synthesize);
  }
  if (labels_) w_.labels.finish_group(group, mine.echoes);
}

/// Sums pulses in time if the pulse is real and tabulated, otherwise via the spectrum.
void PingSimulation::sum_pulses(int first, Workspace::Buffers::PerWorker& mine) {
  if (plan_.spectral)
    plan_.spectral->add(mine.echoes, first, mine.spectral);
  else
    synthesize(mine.echoes, plan_.pulse(), kernels_, w_.columns);
}

/// Computes beams, envelope, gain and codes, one window of rows at a time.
Ping PingSimulation::image() {
  Ping ping;
  ping.request = request_;
  shape_ping(plan_, request_.switches, ping);
  if (!w_.first_hits.empty()) ping.truth = truth_of_beams(plan_, w_.first_hits);
  if (labels_ && !request_.blank) *labels_ = w_.labels.finish(points_);
  plan_.shared_noise.draw({&prepared_.noise, request_.sonar_id, static_cast<std::uint32_t>(request_.number)},
                          request_.switches.noise, !request_.blank, plan_.expected_power, shared_noise_);
  const int rows = plan_.settings.range_bin_count, rows_at_once = std::max(1, window_samples / plan_.settings.samples_per_row);
  pool_.for_each(static_cast<std::size_t>((rows + rows_at_once - 1) / rows_at_once), [&](std::size_t window, int worker) {
    const int first = static_cast<int>(window) * rows_at_once;
    image_rows(first, std::min(first + rows_at_once, rows), w_.workers[static_cast<std::size_t>(worker)], ping);
  });
  // Each worker has its own counters, so that no memory is shared.
  for (const Workspace::Buffers::PerWorker& worker : w_.workers) {
    for (std::size_t s = 0; s < w_.statistics.seconds.size(); ++s) w_.statistics.seconds[s] += worker.statistics.seconds[s];
    w_.statistics.rays += worker.statistics.rays;
    w_.statistics.echoes += worker.statistics.echoes;
  }
  return ping;
}

void PingSimulation::image_rows(int first, int last, Workspace::Buffers::PerWorker& mine, Ping& ping) {
  Stopwatch watch(w_.now_s, mine.statistics);
  const int per_row = plan_.settings.samples_per_row;
  // A window has whole rows, with at most 64 samples. Its beams stay in the cache until they are codes.
  mine.beams.shape(plan_.settings.beam_count, first * per_row, (last - first) * per_row);
  form_beams(w_.columns, plan_.beam_weights, beams_, used_, kernels_, mine.beam_scratch, mine.beams);
  // Points and the pulses of other sonars are added to the beams in their exact directions. Then the beams are mixed. The pulse
  // of another sonar does not come from the range of its rows, so it is not blurred.
  add_points(points_, plan_, mine.beams);
  plan_.beam_mix.blur(kernels_, mine.beams, mine.mixed);
  add_pulses(other_sonars_, plan_, mine.beams);
  plan_.beam_mix.blend(mine.beams, mine.mixed);
  plan_.shared_noise.add(shared_noise_, plan_.expected_power, mine.beams);
  if (crosstalk_.is_audible()) crosstalk_.add(plan_, mine.beams);
  watch.lap(Stage::form_beams);
  receive(mine.beams, plan_, kernels_, mine.receive, ping);
  watch.lap(Stage::receive);
}

Ping simulate(const RayScene& scene, SurfaceCells& cells, const PingRequest& request, const simd::Kernels& kernels,
              Workspace& work, Parallel& pool, PingLabels* labels, BeamChoice beams) {
  if (const RangeImageSettings* const image = range_image_of(request)) return make_range_image(scene, request, *image, pool);
  PingSimulation ping(scene, cells, request, kernels, work, pool, labels, beams);
  ping.find_echo_sources();  // surface cells in view and point echoes
  ping.simulate_columns();   // per column: depth map, echoes (eq. 6), pulses (eq. 8), receiver noise
  return ping.image();       // form_beams: columns to beams; receive: envelope, TVG, samples
}

}  // namespace sonar
