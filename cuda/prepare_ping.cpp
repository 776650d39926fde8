#include "cuda/prepare_ping.hpp"

#include <algorithm>
#include <cmath>

#include "core/pipeline/form_beams.hpp"
#include "core/pipeline/interference.hpp"
#include "core/pipeline/receive.hpp"
#include "core/pipeline/truth.hpp"
#include "core/pipeline/volume.hpp"

namespace sonar::cuda {
namespace {

// Bytes that an arena takes at a time: large enough that a batch needs few, and kept from batch to batch.
constexpr std::size_t table_chunk = 4u << 20, work_chunk = 16u << 20, result_chunk = 4u << 20, cell_chunk = 8u << 20;
constexpr std::size_t tiles_per_part = 256;  // that one worker writes

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
  // All pings of a batch in one table: a step is launched once for all of them.
  std::copy(views.begin(), views.end(), view_table_.host);
  view_memory_.upload(lane);
  tables.upload(lane);
  return view_table_.device;
}

/// A ping while its view is being filled.
struct PingPreparer::Making {
  const PingRequest& request;
  BatchRoom& room;
  const PlanTables& on_device;
  const PingPlan& plan;
  PingScalars scalars;
  std::span<const Pose> bodies;
  PingView view{};
  BatchRoom::Ping ping{};

  std::size_t columns() const { return static_cast<std::size_t>(plan.columns.count); }
  std::size_t samples() const { return static_cast<std::size_t>(plan.samples); }
  std::size_t beams() const { return static_cast<std::size_t>(plan.settings.beam_count); }
};

PingPreparer::PingPreparer(Machine& machine, std::shared_ptr<const Scene> scene, const RayScene& rays,
                           const simd::Kernels& kernels, Parallel& pool, std::size_t cell_bytes, double (*now_s)())
    : scene_(std::move(scene)),
      rays_(rays),
      kernels_(kernels),
      pool_(pool),
      now_s_(now_s),
      flat_(*scene_),
      scene_memory_(machine, Arena::Where::both, 0),
      store_(machine, cell_bytes) {
  // The scene goes to the device once; a ping adds the places of its bodies.
  tracer_.nodes = scene_memory_.put(flat_.nodes());
  tracer_.triangles = scene_memory_.put(flat_.triangles());
  tracer_.still_root = flat_.still_root();
  tracer_.has_still = flat_.has_still() ? 1 : 0;
  scene_memory_.upload(0);
  machine.wait(0);
}

bool PingPreparer::add(const PingRequest& request, std::size_t index, std::shared_ptr<PlanTables> plan, SurfaceCells& cells,
                       int lane, BatchRoom& room) {
  const WaterColumn& water = scene_->water_column;
  // Noise, leak and volume read one table of shaped noise (section 5).
  const bool leak = request.switches.leak && plan->plan().mode.receiver.leak_upa > 0;
  const bool wants_noise = request.switches.noise || leak || (request.switches.volume && water.has_volume());
  set_gain(plan->plan(), request.settings.gain_db);
  if (wants_noise && !plan->plan().expected_power) plan->need_noise(lane);
  Making m{request,
           room,
           *plan,
           plan->plan(),
           make_scalars(plan->plan(), request, flat_.origin()),
           request.bodies_in_world.empty() ? scene_->bodies_in_world : request.bodies_in_world};
  // Constants of the settings first, then those of the ping.
  plan->fill(m.view);
  place_fan(m);
  if (!request.blank) {
    const std::vector<LawTable> laws = laws_of(*scene_, m.plan, m.scalars);
    const double begin = now();
    find_points(m, cells, laws);
    const double points = now();
    if (!find_tiles(m, cells, laws, lane)) return false;
    const auto stage = [&](Stage s) -> double& { return m.ping.statistics.seconds[static_cast<std::size_t>(s)]; };
    stage(request.switches.multipath ? Stage::multipath : Stage::specular) += points - begin;
    stage(m.ping.statistics.tiles_built > 0 ? Stage::build_cells : Stage::cull) += now() - points;
    add_water(m);
    if (m.plan.spectral) {
      SpectralView& v = m.view.spectral;
      // Complex values of all columns: the fine grids of (25), and the spectra folded to one value a sample.
      v.grids = room.work.allocate<double>(2 * m.columns() * static_cast<std::size_t>(v.points)).device;
      v.folded = room.work.allocate<double>(2 * m.columns() * static_cast<std::size_t>(v.period)).device;
    }
  }
  add_receiver(m);
  allocate_results(m);
  m.ping.index = index;
  m.ping.plan = std::move(plan);
  room.views.push_back(m.view);
  room.pings.push_back(std::move(m.ping));
  return true;
}

/// Where the rays start and what they and the cells are measured with.
void PingPreparer::place_fan(Making& m) {
  const PingPlan& plan = m.plan;
  const PingScalars& s = m.scalars;
  // One group of all columns: the CPU divides them for its caches only.
  DepthMap all_columns;
  all_columns.columns = plan.columns.count;
  all_columns.bins = plan.fan.bins;
  const simd::GroupView g = make_group_view(plan, s, all_columns);
  SeaView& sea = m.view.sea;
  sea.conical = g.conical ? 1 : 0;
  sea.columns = plan.columns.count;
  sea.elevations = static_cast<std::int32_t>(plan.fan.elevation_rad.size());
  sea.bins = g.bins;
  sea.expected_power = g.expected_power ? 1 : 0;
  sea.first_edge_sine = g.first_edge_sine;
  sea.columns_per_sine = g.columns_per_sine;
  sea.first_tangent = g.first_tangent;
  sea.bins_per_tangent = g.bins_per_tangent;
  sea.depth_tolerance_m = g.depth_tolerance_m;
  sea.turns_per_m = g.turns_per_m;
  sea.decay_per_m = g.decay_per_m;
  sea.samples_per_m = g.samples_per_m;
  sea.sample_offset = g.sample_offset;
  sea.first_sample = g.first_sample;
  sea.last_sample = g.last_sample;
  std::copy(g.elevation, g.elevation + elevation_terms, sea.elevation);
  sea.origin[0] = s.position_in_scene.x, sea.origin[1] = s.position_in_scene.y, sea.origin[2] = s.position_in_scene.z;
  for (int i = 0; i < 9; ++i) sea.world_from_sonar[i] = static_cast<float>(s.world_from_sonar.m[i / 3][i % 3]);
  // True range [m] of the last sample that can still receive.
  sea.far_m = static_cast<float>(s.max_range_m);
  // Tolerance of the refinement (section 2) [m].
  sea.pulse_width_m = static_cast<float>(plan.pulse_width_m);
  sea.truth_half_width_rad = truth_half_width_rad(plan);

  m.view.has_scene = m.request.blank ? 0 : 1;
  if (m.request.blank) return;
  m.view.tracer = tracer_;
  // Places relative to the origin of rays; see FlatScene.
  const BodyPlaces places = flat_.place(m.bodies);
  m.view.tracer.top = m.room.tables.put(places.top);
  m.view.tracer.bodies = m.room.tables.put(places.bodies);
  m.view.tracer.body_count = static_cast<std::int32_t>(places.bodies.size());
  // Base rays of all columns; each interval between two is refined by itself, so it needs no list.
  const auto elevations = static_cast<std::size_t>(sea.elevations);
  m.view.fan_rays = m.room.work.allocate<FanRay>(elevations * m.columns()).device;
  m.view.depth = m.room.work.allocate<float>(m.columns() * static_cast<std::size_t>(sea.bins + 1)).device;
  if (m.request.switches.keep_truth) m.view.first_hits = m.room.work.allocate<FirstHit>((elevations - 1) * m.columns()).device;
}

PingContext PingPreparer::context_of(const Making& m, SurfaceCells& cells, const std::vector<LawTable>& laws) const {
  return {rays_, cells, m.bodies, laws, m.plan, m.scalars, kernels_, pool_};
}

/// Point targets, specular echoes, other sonars; multipath echoes: those of points as points, those of surfaces as columns.
void PingPreparer::find_points(Making& m, SurfaceCells& cells, const std::vector<LawTable>& laws) {
  const PingContext context = context_of(m, cells, laws);
  // On the CPU: few echoes with many branches. The device adds their pulses to the beams.
  std::vector<PointEcho> points = scatter_points(context);
  const std::vector<ReceivedPulse> pulses = receive_other_sonars(context, m.request);
  if (m.request.switches.specular) specular_echoes_.find(context, points);
  if (m.request.switches.multipath) {
    const MultipathCounts counts = simulate_multipath(context, multipath_, points);
    m.ping.statistics.rays += counts.rays;
    m.ping.statistics.echoes += counts.echoes;
    if (multipath_.has_echoes) {
      // Behind the lead: the device adds from sample 0 on.
      m.view.multipath = m.room.tables.put(multipath_.columns.data) + 2 * multipath_.columns.lead;
      m.view.multipath_stride = multipath_.columns.stride;
    }
  }
  add_points(m, points, pulses);
}

/// Their pulses on the sample grid.
void PingPreparer::add_points(Making& m, std::span<const PointEcho> points, std::span<const ReceivedPulse> pulses) {
  const PingPlan& plan = m.plan;
  std::vector<PulseInBeams> in_beams;
  const auto add = [&](double sine, const SampledPulse& pulse) {
    // Samples [from, from + count) of (8), complex, in double as on the CPU.
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
  // W of every beam at every point's exact direction, worked out on the device.
  m.view.point_weights =
      m.room.work.allocate<double>(static_cast<std::size_t>(m.view.point_count + m.view.pulse_count) * m.beams()).device;
}

bool PingPreparer::find_tiles(Making& m, SurfaceCells& cells, const std::vector<LawTable>& laws, int lane) {
  const PingPlan& plan = m.plan;
  CellView in;
  // As PingSimulation::find_echo_sources: cells within range and fan, in the same order, which is that of every sum.
  in.sonar_in_world = m.scalars.seen_from;
  in.bodies_in_world = m.bodies;
  in.min_range_m = static_cast<float>(m.scalars.min_range_m);
  in.max_range_m = static_cast<float>(m.scalars.max_range_m);
  in.max_sine = static_cast<float>(std::min(1.0, plan.columns.first_sine + plan.columns.spacing));
  in.max_elevation_rad = static_cast<float>(plan.widest_about_axis_rad());
  in.levels = plan.levels;
  const std::vector<TileInView>& seen = cells.in_view(in, pool_);
  // False: the store is full. The caller lets the device finish, empties it and begins this ping again.
  if (!store_.find(seen, lane, m.room.cells, tile_cells_, pool_)) return false;
  prepare_tiles(context_of(m, cells, laws), seen, tiles_);
  m.ping.statistics.tiles = seen.size();
  m.ping.statistics.tiles_built = cells.built_last_time();
  m.ping.statistics.cell_bytes = cells.cached_bytes();
  lay_out_tiles(m, laws);
  return true;
}

/// A tile in the device's layout.
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
  return t;
}

/// The tiles one after the other, every cell a slot.
void PingPreparer::lay_out_tiles(Making& m, const std::vector<LawTable>& laws) {
  // sqrt(sigma_b / mu) of a material, an empty table for Lambert's cosine.
  std::vector<const float*> law_on_device;
  for (const LawTable& law : laws) law_on_device.push_back(m.room.tables.put(law.root));
  const auto tiles = m.room.tables.allocate<TileView>(tiles_.size());
  // Sums of the tiles' counts: finds the tile of a slot by bisection.
  const auto first_slot = m.room.tables.allocate<std::uint32_t>(tiles_.size() + 1);
  pool_.for_each((tiles_.size() + tiles_per_part - 1) / tiles_per_part, [&](std::size_t part, int) {
    const std::size_t end = std::min(tiles_.size(), (part + 1) * tiles_per_part);
    for (std::size_t i = part * tiles_per_part; i < end; ++i)
      tiles.host[i] = view_of(tiles_[i], tile_cells_[i], law_on_device[static_cast<std::size_t>(tiles_[i].seen.tile->material)]);
  });
  // In the order of the tiles: a slot's number fixes the place of its echo in every sum.
  std::uint32_t slots = 0;
  for (std::size_t i = 0; i < tiles_.size(); ++i) {
    first_slot.host[i] = slots;
    slots += static_cast<std::uint32_t>(tiles.host[i].count);
  }
  first_slot.host[tiles_.size()] = slots;
  m.ping.statistics.cells = slots;
  PingView& view = m.view;
  view.tiles = tiles.device;
  view.tile_first_slot = first_slot.device;
  view.tile_count = static_cast<std::uint32_t>(tiles_.size());
  view.slots = slots;
  view.chunks = (slots + slots_a_chunk - 1) / slots_a_chunk;
  Arena& work = m.room.work;
  // Echoes by slot, then sorted by column: ranks within chunks and counts of chunks keep the order of slots in a column.
  view.echoes = work.allocate<Echo>(slots).device;
  view.sorted = work.allocate<Echo>(slots).device;
  view.rank = work.allocate<std::uint32_t>(slots).device;
  view.in_chunk = work.allocate<std::uint32_t>(view.chunks * m.columns()).device;
  view.in_column = work.allocate<std::uint32_t>(m.columns()).device;
  view.column_at = work.allocate<std::uint32_t>(m.columns()).device;
}

/// Reverberation of the water itself.
void PingPreparer::add_water(Making& m) {
  const Volume volume(scene_->water_column, m.plan, m.scalars);
  if (!volume.is_audible()) return;
  // (17): slices of the fan [rad], power by sample [uPa^2], width of a column in u.
  std::vector<VolumeSlice> slices;
  for (const Volume::Slice& s : volume.slices()) slices.push_back({s.range_per_x, s.weight, s.bin, 0});
  std::vector<double> width;
  for (int k = 0; k < m.plan.columns.count; ++k) width.push_back(volume_column_width(m.plan, k));
  m.view.slices = m.room.tables.put(slices);
  m.view.slice_count = static_cast<std::int32_t>(slices.size());
  m.view.open_power = m.room.tables.put(volume.open_power_upa2());
  m.view.column_width = m.room.tables.put(width);
  // By column and sample: how much of the fan [rad] ends there.
  m.view.blocked = m.room.work.allocate<double>(m.samples() * m.columns()).device;
  m.view.open_fan = volume.open_fan();
  m.view.volume_samples_per_m = m.scalars.samples_per_m;
  m.view.volume_sample_offset = m.scalars.sample_offset;
}

/// Noise, leak, crosstalk and gains.
void PingPreparer::add_receiver(Making& m) {
  PingView& view = m.view;
  // The same draws as on the CPU, from (seed, sonar, ping, column).
  view.noise_key = {key_of(m.request.seed, Domain::noise_place), m.request.sonar_id,
                    static_cast<std::uint32_t>(m.request.number)};
  view.has_noise = m.request.switches.noise ? 1 : 0;
  // rms of a column [uPa]: (30) over the root of sum_k W_jk^2.
  view.noise_rms = static_cast<float>(m.plan.column_noise_upa);
  const Leak leak(m.plan, m.request.switches);
  if (leak.is_audible() && !m.request.blank) {
    view.leak_rms = m.room.tables.put(leak.rms_upa());
    view.leak_samples = static_cast<std::int32_t>(leak.rms_upa().size());
    // (31): powers of the fixed and the changing part add up to 1.
    view.leak_steady = static_cast<float>(std::sqrt(1 - Leak::changing_share));
    view.leak_changing = static_cast<float>(std::sqrt(Leak::changing_share));
  }
  const Crosstalk crosstalk(m.plan, m.request.switches);
  if (crosstalk.is_audible()) {
    // (35).
    const Crosstalk::Mix mix = crosstalk.mix(m.plan.expected_power);
    view.crosstalk_own = mix.own;
    view.crosstalk_leaked = mix.leaked;
    view.crosstalk = m.room.work.allocate<float>(2 * m.samples()).device;
  }
  // (36), (37): gain TVG / full scale, squared, since the receiver works on powers.
  view.row_power_factor = m.room.tables.put(m.plan.row_power_factor);
  // Complex: columns before beamforming, beams after it [uPa].
  view.signals = m.room.work.allocate<float>(2 * m.samples() * m.columns()).device;
  view.beam_signals = m.room.work.allocate<float>(2 * m.samples() * m.beams()).device;
}

/// Room for what comes back.
void PingPreparer::allocate_results(Making& m) {
  Ping& ping = m.ping.ping;
  ping.request = m.request;
  shape_ping(m.plan, m.request.switches, ping);
  // Results are empty where the request keeps nothing of the kind.
  m.ping.codes = m.room.results.allocate<std::uint8_t>(ping.samples.size());
  m.ping.pressure = m.room.results.allocate<float>(ping.pressure_upa.size());
  m.ping.beams = m.room.results.allocate<float>(2 * ping.beam_signal_upa.size());
  m.ping.counters = m.room.results.allocate<std::uint32_t>(counters_a_ping);
  if (m.request.switches.keep_truth) m.ping.truth = m.room.results.allocate<FirstHit>(m.columns());
  PingView& view = m.view;
  view.codes = m.ping.codes.device;
  view.pressure = m.ping.pressure.device;
  view.kept_beams = m.ping.beams.device;
  view.counters = m.ping.counters.device;
  view.column_truth = m.ping.truth.device;
}

}  // namespace sonar::cuda
