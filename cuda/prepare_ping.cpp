#include "cuda/prepare_ping.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstring>

#include "core/pipeline/form_beams.hpp"
#include "core/pipeline/truth.hpp"
#include "cuda/steps.hpp"

namespace sonar::cuda {
namespace {

// Sizes of the arenas' chunks in bytes. They are so large that a batch needs few chunks. Chunks are kept from batch to batch.
constexpr std::size_t table_chunk = 4u << 20, work_chunk = 16u << 20, result_chunk = 4u << 20, cell_chunk = 8u << 20;
constexpr std::size_t tiles_per_part = 256;  // number of tiles that one worker writes

}  // namespace

BatchRoom::BatchRoom(Machine& machine, int which_lane, std::size_t most_pings)
    : lane(which_lane),
      tables(machine, Arena::Where::both, table_chunk),
      work(machine, Arena::Where::device, work_chunk),
      results(machine, Arena::Where::both, result_chunk, which_lane),
      cells(machine, Arena::Where::host, cell_chunk),
      view_memory_(machine, Arena::Where::both, 0),
      view_table_(view_memory_.allocate<PingView>(most_pings)) {}

const PingView* BatchRoom::upload() {
  // All pings of a batch share one table, because a step is launched once for all of them.
  std::copy(views.begin(), views.end(), view_table_.host);
  view_memory_.upload(lane);
  tables.upload(lane);
  return view_table_.device;
}

PingPreparer::PingPreparer(Machine& machine, std::shared_ptr<const Scene> scene, const RayScene& rays,
                           const simd::Kernels& kernels, Parallel& pool, std::size_t cell_bytes, double (*now_s)())
    : scene_(std::move(scene)),
      rays_(rays),
      kernels_(kernels),
      pool_(pool),
      now_s_(now_s),
      flat_(*scene_),
      scene_memory_(machine, Arena::Where::both, 0),
      store_(machine, cell_bytes),
      workers_(static_cast<std::size_t>(pool.threads())) {
  // The scene is sent to the device once. Each ping adds the poses of its bodies.
  tracer_.nodes = scene_memory_.put(flat_.nodes());
  tracer_.triangles = scene_memory_.put(flat_.triangles());
  tracer_.still_root = flat_.still_root();
  tracer_.has_still = flat_.has_still() ? 1 : 0;
  scene_memory_.upload(0);
  machine.wait(0);
}

bool PingPreparer::may_go_together(const AskedPing& a, const AskedPing& b) {
  const auto same_places = [](const std::vector<Pose>& x, const std::vector<Pose>& y) {
    return x.size() == y.size() && (x.empty() || std::memcmp(x.data(), y.data(), x.size() * sizeof(Pose)) == 0);
  };
  // All threads compute the multipath echoes of one ping together.
  const PingRequest &x = a.wanted->request, &y = b.wanted->request;
  return !x.switches.multipath && !y.switches.multipath && (a.plan != b.plan || x.settings.gain_db == y.settings.gain_db) &&
         same_places(x.bodies_in_world, y.bodies_in_world);
}

std::vector<AskedPing> PingPreparer::add(std::span<const AskedPing> pings, SurfaceCells& cells, int lane, BatchRoom& room) {
  std::vector<Making> all;
  all.reserve(pings.size());
  for (const AskedPing& asked : pings) all.push_back(begin(asked, lane, room));
  const bool alone = all.size() == 1;
  Parallel& pool = alone ? pool_ : one_thread_;  // pool for the loops within a ping
  const auto context_of = [&](Making& m) -> PingContext {
    if (m.laws.empty() && !m.request().blank) {
      m.laws = laws_of(*scene_, m.plan, m.scalars);
      m.turned_away = turned_away_of(*scene_, cells.skins(), m.bodies, m.scalars.seen_from.position_m);
    }
    return {rays_, cells, m.bodies, m.laws, m.turned_away, m.plan, m.scalars, kernels_, pool};
  };
  // Multipath echoes need other cells. Their SurfaceCells::in_view() must come before that of look().
  if (alone) find_points(all[0], context_of(all[0]), workers_[0]);
  look(all, cells);
  pool_.for_each(all.size(), [&](std::size_t i, int thread) {
    Worker& worker = workers_[static_cast<std::size_t>(thread)];
    const PingContext context = context_of(all[i]);
    if (!alone) find_points(all[i], context, worker);
    complete(all[i], context, lane, worker);
  });
  std::vector<AskedPing> left;
  for (Making& m : all) {
    if (!m.fits) {
      left.push_back(m.asked);
      continue;
    }
    m.ping.wanted = m.asked.wanted;
    m.ping.wanted->state = WantedPing::State::under_way;
    m.ping.plan = m.asked.plan;
    room.views.push_back(m.view);
    room.pings.push_back(std::move(m.ping));
  }
  return left;
}

/// Does the work that must not run in parallel: sets the plan's gain, makes its noise, and begins the view with its values.
PingPreparer::Making PingPreparer::begin(const AskedPing& asked, int lane, BatchRoom& room) {
  const PingRequest& request = asked.wanted->request;
  PlanTables& plan = *asked.plan;
  // Leak and volume also read a table of shaped noise: that of the noise, or one with the pulse's correlation (docs/acoustics.md,
  // section 5).
  const bool leak = request.switches.leak && plan.plan().mode.receiver.leak_upa > 0;
  const bool needs_noise = request.switches.noise || leak || (request.switches.volume && scene_->water_column.has_volume());
  set_gain(plan.plan(), request.settings.gain_db);
  if (needs_noise && !plan.plan().expected_power) plan.need_noise(lane);
  Making m{asked, room, plan.plan(), make_scalars(plan.plan(), request, flat_.origin()),
           request.bodies_in_world.empty() ? scene_->bodies_in_world : request.bodies_in_world};
  // The values of the plan come first; later functions add those of the ping.
  plan.fill(m.view);
  return m;
}

/// Finds cells within range and fan, as PingSimulation::find_echo_sources does. Their order is the same, because it is the
/// order of sums.
void PingPreparer::look(std::span<Making> all, SurfaceCells& cells) {
  const double begin = now();
  std::vector<CellView> views;
  for (const Making& m : all) {
    if (m.request().blank) continue;
    CellView& in = views.emplace_back();
    in.sonar_in_world = m.scalars.seen_from;
    in.bodies_in_world = m.bodies;
    in.min_range_m = static_cast<float>(m.scalars.min_range_m);
    in.max_range_m = static_cast<float>(m.scalars.max_range_m);
    m.plan.aim(in);
  }
  if (views.empty()) return;
  if (found_.size() < views.size()) found_.resize(views.size());
  const std::span<CellsInView> found(found_.data(), views.size());
  if (views.size() == 1) {  // all threads process one view
    found[0].tiles = cells.in_view(views[0], pool_);
    found[0].built = cells.built_last_time();
    found[0].sonar_from_object.assign(cells.sonar_from_objects().begin(), cells.sonar_from_objects().end());
  } else {
    cells.in_views(views, pool_, found);
  }
  const double took = (now() - begin) / static_cast<double>(views.size());
  std::size_t next = 0;
  for (Making& m : all) {
    if (m.request().blank) continue;
    m.looks_at = std::move(views[next]);  // tiles contain pointers to its levels, whose addresses do not change
    m.seen = &found[next++];
    m.ping.statistics.cell_bytes = cells.cached_bytes();
    m.seconds(m.seen->built > 0 ? Stage::build_cells : Stage::cull) += took;
  }
}

void PingPreparer::complete(Making& m, const PingContext& context, int lane, Worker& worker) {
  place_fan(m);
  if (!m.request().blank) {
    const double begin = now();
    m.fits = find_tiles(m, context, lane, worker);
    if (!m.fits) return;
    m.seconds(m.seen->built > 0 ? Stage::build_cells : Stage::cull) += now() - begin;
    add_water(m);
    if (m.plan.spectral) {
      SpectralView& v = m.view.spectral;
      // Complex values of all columns: the fine grids of eq. 25, and the spectra folded to one value per sample.
      v.grids = m.room.work.allocate<double>(2 * m.columns() * static_cast<std::size_t>(v.points)).device;
      v.folded = m.room.work.allocate<double>(2 * m.columns() * static_cast<std::size_t>(v.period)).device;
    }
  }
  add_receiver(m);
  allocate_results(m);
}

/// Finds echoes of point targets, specular echoes, pulses of other sonars, and multipath echoes (of points and of surfaces).
void PingPreparer::find_points(Making& m, const PingContext& context, Worker& worker) {
  if (m.request().blank) return;
  const double begin = now();
  // The CPU computes these few echoes, because they need many branches. The device adds their pulses to the beams.
  std::vector<PointEcho> points = scatter_points(context);
  const std::vector<ReceivedPulse> pulses = receive_other_sonars(context, m.request());
  if (m.request().switches.specular) worker.specular_echoes.find(context, points);
  if (m.request().switches.multipath) {
    const MultipathCounts counts = simulate_multipath(context, multipath_, points);
    m.ping.statistics.rays += counts.rays;
    m.ping.statistics.echoes += counts.echoes;
    if (multipath_.has_echoes) {
      // The pointer skips the lead, because the device adds from sample 0 on.
      m.view.multipath = m.room.tables.put(multipath_.columns.data) + 2 * multipath_.columns.lead;
      m.view.multipath_stride = multipath_.columns.stride;
    }
  }
  add_points(m, points, pulses);
  m.seconds(m.request().switches.multipath ? Stage::multipath : Stage::specular) += now() - begin;
}

/// Adds the pulses of points and of other sonars on the sample grid.
void PingPreparer::add_points(Making& m, std::span<const PointEcho> points, std::span<const ReceivedPulse> pulses) {
  const PingPlan& plan = m.plan;
  std::vector<PulseInBeams> in_beams;
  const auto add = [&](double sine, const SampledPulse& pulse) {
    // Samples [from, from + count) of eq. 8, complex, in double as on the CPU.
    const auto& [from, values] = pulse;
    if (values.empty()) return;
    static_assert(sizeof(std::complex<double>) == 2 * sizeof(double));
    const auto slice = m.room.tables.allocate<double>(2 * values.size());
    std::memcpy(slice.host, values.data(), 2 * sizeof(double) * values.size());
    in_beams.push_back({sine, slice.device, from, from + static_cast<int>(values.size())});
  };
  for (const PointEcho& point : points) add(point.sine, place_pulse(point, plan, 0, plan.samples));
  m.view.point_count = static_cast<std::int32_t>(in_beams.size());
  m.view.points = m.room.tables.put(in_beams);
  in_beams.clear();
  for (const ReceivedPulse& pulse : pulses) add(pulse.sine, tone_of(pulse, 0, plan.samples));
  m.view.pulse_count = static_cast<std::int32_t>(in_beams.size());
  m.view.pulses = m.room.tables.put(in_beams);
  // W of every beam at every point's exact direction. The device computes it.
  m.view.point_weights =
      m.room.work.allocate<double>(static_cast<std::size_t>(m.view.point_count + m.view.pulse_count) * m.beams()).device;
}

bool PingPreparer::find_tiles(Making& m, const PingContext& context, int lane, Worker& worker) {
  // Returns false if the store is full. The caller then waits for the device, empties the store and begins this ping again.
  if (!store_.find(m.seen->tiles, lane, m.room.cells, worker.tile_cells, context.pool)) return false;
  prepare_tiles(context, m.seen->tiles, m.seen->sonar_from_object, worker.tiles);
  m.ping.statistics.tiles = m.seen->tiles.size();
  m.ping.statistics.tiles_built = m.seen->built;
  lay_out_tiles(m, worker, context.pool);
  return true;
}

/// Converts a tile to the device's layout.
TileView PingPreparer::view_of(const PreparedTile& prepared, const std::int16_t* cells, const float* law) {
  const simd::TileSeen& seen = prepared.seen;
  const CellTile& tile = *seen.tile;
  TileView t{};
  t.cells = cells;
  t.law = law;
  t.count = tile.count;
  t.axis = tile.axis;
  // Cells are 16-bit offsets from the tile's centre, in this unit [m].
  t.position_unit_m = tile.position_unit_m;
  std::copy_n(seen.from_sonar_object, 3, t.from_sonar_object);
  std::copy_n(seen.from_sonar, 3, t.from_sonar);
  std::copy_n(seen.turn, 9, t.turn);
  t.range_m = seen.range_m;
  t.sample_shift = seen.sample_shift;
  t.phase_turns = seen.phase_turns;
  t.amplitude = seen.amplitude;
  t.area_amplitude = seen.area_amplitude;
  t.fade_in_from_m = seen.fade_in_from_m;
  t.fade_in_per_m = seen.fade_in_per_m;
  t.fade_out_to_m = seen.fade_out_to_m;
  t.fade_out_per_m = seen.fade_out_per_m;
  t.from_tangent = seen.from_tangent;
  t.to_tangent = seen.to_tangent;
  t.in_side_lobes = seen.in_side_lobes ? 1 : 0;
  t.tolerance_share = seen.tolerance_share;
  t.turned_away = seen.turned_away;
  t.mark = seen.mark;
  t.moves = seen.moves ? 1 : 0;
  if (seen.moves) {
    std::copy_n(seen.seen_turn, 9, t.seen_turn);
    std::copy_n(seen.seen_place, 3, t.seen_place);
  }
  return t;
}

/// Arranges the tiles one after the other. Every cell gets a slot.
void PingPreparer::lay_out_tiles(Making& m, const Worker& worker, Parallel& pool) {
  const std::vector<PreparedTile>& prepared = worker.tiles;
  // sqrt(sigma_b / mu) of a material. For Lambert's cosine the table is empty.
  std::vector<const float*> law_on_device;
  for (const LawTable& law : m.laws) law_on_device.push_back(m.room.tables.put(law.root));
  const auto tiles = m.room.tables.allocate<TileView>(prepared.size());
  // Sums of the tiles' counts. With them, the tile of a slot is found by bisection.
  const auto first_slot = m.room.tables.allocate<std::uint32_t>(prepared.size() + 1);
  pool.for_each((prepared.size() + tiles_per_part - 1) / tiles_per_part, [&](std::size_t part, int) {
    const std::size_t end = std::min(prepared.size(), (part + 1) * tiles_per_part);
    for (std::size_t i = part * tiles_per_part; i < end; ++i)
      tiles.host[i] =
          view_of(prepared[i], worker.tile_cells[i], law_on_device[static_cast<std::size_t>(prepared[i].seen.tile->material)]);
  });
  // Slots have the order of the tiles. The number of a slot is the position of its echo in sums.
  std::uint32_t slots = 0;
  for (std::size_t i = 0; i < prepared.size(); ++i) {
    first_slot.host[i] = slots;
    slots += static_cast<std::uint32_t>(tiles.host[i].count);
  }
  first_slot.host[prepared.size()] = slots;
  m.ping.statistics.cells = slots;
  PingView& view = m.view;
  view.tiles = tiles.device;
  view.tile_first_slot = first_slot.device;
  view.tile_count = static_cast<std::uint32_t>(prepared.size());
  view.slots = slots;
  view.chunks = (slots + slots_a_chunk - 1) / slots_a_chunk;
  Arena& work = m.room.work;
  // Echoes by slot, then sorted by column. Ranks within chunks and counts of chunks keep the order of slots in a column.
  view.echoes = work.allocate<Echo>(slots).device;
  view.sorted = work.allocate<Echo>(slots).device;
  view.rank = work.allocate<std::uint32_t>(slots).device;
  view.in_chunk = work.allocate<std::uint32_t>(view.chunks * m.columns()).device;
  view.in_column = work.allocate<std::uint32_t>(m.columns()).device;
  view.column_at = work.allocate<std::uint32_t>(m.columns()).device;
}

namespace {

/// The row of the benchmark's table for a step.
constexpr Stage stage_of(Step step) {
  if (step <= Step::first_hits) return Stage::trace;
  if (step <= Step::place) return Stage::scatter;
  if (step <= Step::unfold) return Stage::synthesize;
  if (step <= Step::finish_columns) return Stage::noise;
  return step == Step::receive ? Stage::receive : Stage::form_beams;
}

}  // namespace

void share_times(const StepSeconds& seconds, BatchRoom& room) {
  const auto pings = static_cast<double>(room.pings.size());
  for (BatchRoom::Ping& ping : room.pings) {
    ping.statistics.seconds[static_cast<std::size_t>(Stage::synthesize)] += seconds.transforms / pings;
    for (int step = 0; step < step_count; ++step)
      ping.statistics.seconds[static_cast<std::size_t>(stage_of(static_cast<Step>(step)))] += seconds.of[step] / pings;
  }
}

void take_results(BatchRoom::Ping& from, const PingView& view) {
  Ping& ping = from.wanted->ping = std::move(from.ping);
  const auto copy = [](void* to, const void* host, std::size_t bytes) {
    if (bytes > 0) std::memcpy(to, host, bytes);
  };
  copy(ping.samples.data(), from.codes.host, ping.samples.size());
  copy(ping.pressure_upa.data(), from.pressure.host, ping.pressure_upa.size() * sizeof(float));
  copy(ping.beam_signal_upa.data(), from.beams.host, ping.beam_signal_upa.size() * sizeof(std::complex<float>));
  if (ping.request.switches.keep_truth) {
    std::vector<BeamTruth> by_column(static_cast<std::size_t>(view.sea.columns));
    if (view.first_hits)
      for (std::size_t k = 0; k < by_column.size(); ++k)
        if (from.truth.host[k].object != no_object) by_column[k] = {from.truth.host[k].range_m, from.truth.host[k].object};
    ping.truth = truth_of_beams(from.plan->plan(), by_column);
  }
  // Rays and echoes are counted on the device. The number of base rays is known in advance.
  if (view.has_scene != 0) {
    const SeaView& sea = view.sea;
    // A ray of the side lobes serves several columns.
    const int sides = 2 * sea.side_elevations, shared = (sea.columns + sea.side_columns - 1) / sea.side_columns;
    from.statistics.rays +=
        from.counters.host[0] + static_cast<std::size_t>(sea.columns * (sea.elevations - sides) + shared * sides);
    from.statistics.echoes += from.counters.host[1];
  }
  from.wanted->statistics = from.statistics;
  from.wanted->state = WantedPing::State::done;
}

}  // namespace sonar::cuda
