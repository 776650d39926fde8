#include <algorithm>
#include <cmath>

#include "core/pipeline/receive.hpp"
#include "core/pipeline/truth.hpp"
#include "core/pipeline/volume.hpp"
#include "cuda/prepare_ping.hpp"

namespace sonar::cuda {

/// Sets the origin of rays, and the geometry for rays and cells.
void PingPreparer::place_fan(Making& m) {
  const PingPlan& plan = m.plan;
  const PingScalars& s = m.scalars;
  // One group contains all columns. The CPU divides columns into groups only because of its caches.
  DepthMap all_columns;
  all_columns.columns = plan.columns.count;
  all_columns.bins = plan.fan.bins;
  all_columns.has_upper_marks = has_upper_marks(scene_->objects.size());
  const simd::GroupView g = make_group_view(plan, s, all_columns, 0, plan.columns.count);
  SeaView& sea = m.view.sea;
  sea.conical = g.conical ? 1 : 0;
  sea.columns = plan.columns.count;
  sea.elevations = static_cast<std::int32_t>(plan.fan.elevation_rad.size());
  sea.bins = g.bins;
  sea.expected_power = g.expected_power ? 1 : 0;
  sea.first_edge_sine = g.first_edge_sine;
  sea.columns_per_sine = g.columns_per_sine;
  sea.axis = g.axis;
  sea.side_elevations = plan.fan.side_elevations;
  sea.side_columns = PingPlan::side_columns;
  sea.columns_beside = g.columns_beside;
  sea.has_upper_marks = g.has_upper_marks ? 1 : 0;
  sea.elevation_aperture = g.elevation_aperture;
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
  // Largest true range [m] whose echoes reach the last sample.
  sea.far_m = static_cast<float>(s.max_range_m);
  // Tolerance of the refinement (docs/acoustics.md, section 2) [m].
  sea.pulse_width_m = static_cast<float>(plan.pulse_width_m);
  sea.column_spacing = static_cast<float>(plan.columns.spacing);
  sea.truth_half_width_rad = truth_half_width_rad(plan);

  m.view.has_scene = m.request().blank ? 0 : 1;
  if (m.request().blank) return;
  m.view.tracer = tracer_;
  // Positions are relative to the origin of rays; see FlatScene.
  const BodyPlaces places = flat_.place(m.bodies);
  m.view.tracer.top = m.room.tables.put(places.top);
  m.view.tracer.bodies = m.room.tables.put(places.bodies);
  m.view.tracer.body_count = static_cast<std::int32_t>(places.bodies.size());
  // Base rays of all columns. Each interval between two rays is refined separately, so no list is needed.
  const auto elevations = static_cast<std::size_t>(sea.elevations);
  m.view.fan_rays = m.room.work.allocate<FanRay>(elevations * m.columns()).device;
  m.view.depth_slope = m.room.work.allocate<float>(m.columns() * static_cast<std::size_t>(sea.bins + 1)).device;
  m.view.depth = m.room.work.allocate<float>(m.columns() * static_cast<std::size_t>(sea.bins + 1)).device;
  if (m.request().switches.keep_truth) m.view.first_hits = m.room.work.allocate<FirstHit>((elevations - 1) * m.columns()).device;
}

/// Adds the tables of the water's reverberation.
void PingPreparer::add_water(Making& m) {
  const Volume volume(scene_->water_column, m.plan, m.scalars);
  if (!volume.is_audible()) return;
  // Eq. 17: slices of the fan [rad], power by sample [uPa^2], width of a column in u.
  std::vector<VolumeSlice> slices;
  for (const Volume::Slice& s : volume.slices()) slices.push_back({s.range_per_x, s.weight, s.bin, 0});
  std::vector<double> width;
  for (int k = 0; k < m.plan.columns.count; ++k) width.push_back(volume_column_width(m.plan, k));
  m.view.slices = m.room.tables.put(slices);
  m.view.slice_count = static_cast<std::int32_t>(slices.size());
  m.view.open_power = m.room.tables.put(volume.open_power_upa2());
  m.view.column_width = m.room.tables.put(width);
  // Part of the fan [rad] that ends in each column and sample.
  m.view.blocked = m.room.work.allocate<double>(m.samples() * m.columns()).device;
  m.view.open_fan = volume.open_fan();
  m.view.volume_samples_per_m = m.scalars.samples_per_m;
  m.view.volume_sample_offset = m.scalars.sample_offset;
}

/// Adds the tables of noise, leak, crosstalk and gains.
void PingPreparer::add_receiver(Making& m) {
  PingView& view = m.view;
  // The same draws as on the CPU, from (seed, sonar, ping, column).
  view.noise_key = {key_of(m.request().seed, Domain::noise_place), m.request().sonar_id,
                    static_cast<std::uint32_t>(m.request().number)};
  view.has_noise = m.request().switches.noise ? 1 : 0;
  // rms of a column [uPa]: eq. 30 divided by the root of sum_k W_jk^2.
  view.noise_rms = static_cast<float>(m.plan.column_noise_upa);
  const Leak leak(m.plan, m.request().switches);
  if (leak.is_audible() && !m.request().blank) {
    view.leak_rms = m.room.tables.put(leak.rms_upa());
    view.leak_samples = static_cast<std::int32_t>(leak.rms_upa().size());
    // Eq. 31: powers of the steady and the changing part add up to 1. If the leak is shared, its steady part is added to the
    // beams.
    view.leak_steady = leak.steady();
    view.shared_leak_samples = static_cast<std::int64_t>(m.plan.shared_noise.leak_upa().size());
    view.leak_changing = static_cast<float>(Leak::changing_part);
  }
  const Crosstalk crosstalk(m.plan, m.request().switches);
  if (crosstalk.is_audible()) {
    // Eq. 35.
    const Crosstalk::Mix mix = crosstalk.mix(m.plan.expected_power);
    view.crosstalk_own = mix.own;
    view.crosstalk_leaked = mix.leaked;
    view.crosstalk = m.room.work.allocate<float>(2 * m.samples()).device;
  }
  if (m.plan.beam_mix.blurs() || m.plan.beam_mix.blends())
    view.mixed = m.room.work.allocate<float>(2 * m.samples() * m.beams()).device;
  // Eq. 36 and 37: gain TVG / full scale, squared, because the receiver works on powers.
  view.row_power_factor = m.room.tables.put(m.plan.row_power_factor);
  // Complex values: columns before beamforming, beams after it [uPa].
  view.signals = m.room.work.allocate<float>(2 * m.samples() * m.columns()).device;
  view.beam_signals = m.room.work.allocate<float>(2 * m.samples() * m.beams()).device;
}

/// Reserves the memory of the results that are downloaded.
void PingPreparer::allocate_results(Making& m) {
  Ping& ping = m.ping.ping;
  ping.request = m.request();
  shape_ping(m.plan, m.request().switches, ping);
  // Results that the request does not keep are empty.
  m.ping.codes = m.room.results.allocate<std::uint8_t>(ping.samples.size());
  m.ping.pressure = m.room.results.allocate<float>(ping.pressure_upa.size());
  m.ping.beams = m.room.results.allocate<float>(2 * ping.beam_signal_upa.size());
  m.ping.counters = m.room.results.allocate<std::uint32_t>(counters_a_ping);
  if (m.request().switches.keep_truth) m.ping.truth = m.room.results.allocate<FirstHit>(m.columns());
  PingView& view = m.view;
  view.codes = m.ping.codes.device;
  view.pressure = m.ping.pressure.device;
  view.kept_beams = m.ping.beams.device;
  view.counters = m.ping.counters.device;
  view.column_truth = m.ping.truth.device;
}

}  // namespace sonar::cuda
