#include "core/pipeline/ping_plan.hpp"

#include <array>
#include <cmath>

#include "core/base/units.hpp"
#include "core/pipeline/arithmetic/receiver.hpp"
#include "core/pipeline/arithmetic/waveform.hpp"
#include "core/sonar/bearings.hpp"

namespace sonar {
namespace {

constexpr double widest_column_in_beams = 0.35;  // docs/acoustics.md, section 2
constexpr double margin_in_beams = 3.0;          // columns beyond the sector; without them, beams at its edges would be too weak
constexpr double flat_margin_in_beams = 1.5;     // part of the margin with full transmitter amplitude
constexpr int base_elevations = 48;              // docs/acoustics.md, section 2
constexpr double fan_edge_amplitude = 0.1;       // the fan reaches the -20 dB points of the two-way pattern
constexpr double side_lobe_two_way = 5.62e-3;    // -45 dB: lower side lobes are left out
constexpr double side_step_rad = 0.19;           // step between rays in side lobes; interpolation is exact on planes
constexpr int side_bins = 32;                    // bins of the depth map on either side
// Least number of cells in the area that a beam and a pulse cover in side lobes. Cell sizes are powers of two, so there are up
// to four times as many.
constexpr double side_cells_of_speckle = 0.22, side_cells_of_expected_power = 16;
constexpr double unit_fan_over_width = 2.3;  // width of the fan without a pattern
constexpr double widest_fan_rad = 1.4;

double half_aperture_sine(const FrequencyMode& mode) { return std::sin(static_cast<double>(mode.horizontal_aperture_rad) / 2); }

/// -3 dB widths, in the sine, of the narrowest and the widest beam.
struct BeamWidths {
  double narrowest, widest;
};
BeamWidths beam_width_sines(const FrequencyMode& mode) {
  const double nominal = 2 * std::sin(static_cast<double>(mode.pattern.azimuth_width_rad) / 2);
  if (!mode.has_own_widths()) return {nominal, nominal};
  BeamWidths widths{2, 0};
  for (std::size_t j = 0; j < mode.beam_widths_rad.size(); ++j) {
    const double width = 2 * std::sin(static_cast<double>(mode.beam_widths_rad[j]) / 2) * std::cos(mode.beam_azimuths_rad[j]);
    widths = {std::min(widths.narrowest, width), std::max(widths.widest, width)};
  }
  return widths;
}

double narrowest_beam_rad(const FrequencyMode& mode) {
  return mode.has_own_widths() ? beam_width_sines(mode).narrowest : static_cast<double>(mode.pattern.azimuth_width_rad);
}

/// The angle at which the peaks of the two-way pattern have fallen below side_lobe_two_way. The peaks are 1 / (pi x)^2 at x =
/// L_v / lambda sin psi.
double side_lobe_reach_rad(const BeamPattern& pattern) {
  const double sine = 1 / (pi * std::sqrt(side_lobe_two_way) * elevation_aperture_in_wavelengths(pattern));
  return sine < 1 ? std::min(std::asin(sine), widest_fan_rad) : widest_fan_rad;
}

Fan make_fan(const FrequencyMode& mode, const PingSettings& settings, double pulse_width_m, bool side_lobes) {
  Fan fan;
  const bool has_pattern = mode.pattern.elevation_taper != Taper::unit;
  const double reach = has_pattern ? elevation_reach_rad(mode.pattern, fan_edge_amplitude)
                                   : static_cast<double>(mode.pattern.elevation_width_rad) * unit_fan_over_width / 2;
  fan.half_angle_rad = std::min(reach, widest_fan_rad);
  const double tangent = std::tan(fan.half_angle_rad);
  // At full range a bin of the depth map spans at most 0.7 pulse widths, unless this needs more than 2048 bins.
  const double wanted = settings.range_m * 2 * tangent / (0.7 * pulse_width_m);
  fan.bins = 256;
  while (fan.bins < 2048 && fan.bins < wanted) fan.bins *= 2;
  fan.axis.edge_tangent = static_cast<float>(tangent);
  fan.axis.bins_per_tangent = fan.axis.side_bins_per_tangent = static_cast<float>(fan.bins / (2 * tangent));
  fan.reach_rad =
      side_lobes && has_pattern ? std::max(side_lobe_reach_rad(mode.pattern), fan.half_angle_rad) : fan.half_angle_rad;
  const double side_rad = fan.reach_rad - fan.half_angle_rad;
  if (side_rad > 0) {
    fan.axis.side_bins_per_tangent = static_cast<float>(side_bins / (std::tan(fan.reach_rad) - tangent));
    fan.bins += 2 * side_bins;
    fan.side_elevations = static_cast<int>(std::ceil(side_rad / side_step_rad));
  }
  fan.axis.middle_bin = static_cast<float>(fan.bins) / 2;
  for (int bin = 0; bin <= fan.bins; ++bin) fan.tangent.push_back(tangent_of_bin(fan.axis, static_cast<float>(bin)));
  for (int e = -fan.side_elevations; e < base_elevations + fan.side_elevations; ++e) {
    // Moves rays away from round angles, because a ray exactly on the edge between two triangles can miss both.
    const double nudge = e == 0 || e == base_elevations - 1 ? 0 : 0.0137;
    double angle = fan.half_angle_rad * (2 * (std::clamp(e, 0, base_elevations - 1) + nudge) / (base_elevations - 1) - 1);
    const double step = side_rad / std::max(fan.side_elevations, 1);
    angle += step * (std::min(e, 0) + std::max(e - (base_elevations - 1), 0));
    fan.elevation_rad.push_back(static_cast<float>(std::clamp(angle, -fan.reach_rad, fan.reach_rad)));
  }
  return fan;
}

/// Fits the pattern at Chebyshev points of the fan. The pattern is an entire function of w = sin^2, so few terms are enough.
std::vector<float> fit_elevation(const FrequencyMode& mode, double half_angle_rad) {
  constexpr int n = elevation_terms;
  if (mode.pattern.elevation_taper == Taper::unit) {
    std::vector<float> one(n, 0.0f);
    one[0] = 1;
    return one;
  }
  const double aperture = elevation_aperture_in_wavelengths(mode.pattern);
  // docs/acoustics.md, eq. 34: D_v(psi) = sinc^2((L_v / lambda) sin psi) as a polynomial in w = sin^2 psi.
  const double top = std::pow(std::sin(half_angle_rad), 2);
  // Newton's divided differences at Chebyshev nodes of [0, top], which are then expanded to plain powers.
  std::array<double, n> node{}, coefficient{};
  for (int i = 0; i < n; ++i) {
    node[static_cast<std::size_t>(i)] = top * 0.5 * (1 - std::cos(pi * (i + 0.5) / n));
    coefficient[static_cast<std::size_t>(i)] =
        elevation_two_way(aperture, std::asin(std::sqrt(node[static_cast<std::size_t>(i)])));
  }
  for (int order = 1; order < n; ++order)
    for (int i = n - 1; i >= order; --i) {
      const auto k = static_cast<std::size_t>(i);
      coefficient[k] = (coefficient[k] - coefficient[k - 1]) / (node[k] - node[k - static_cast<std::size_t>(order)]);
    }
  std::array<double, n> power{};
  for (int i = n - 1; i >= 0; --i) {  // power = power * (w - node_i) + coefficient_i
    for (int k = n - 1; k > 0; --k)
      power[static_cast<std::size_t>(k)] =
          power[static_cast<std::size_t>(k - 1)] - node[static_cast<std::size_t>(i)] * power[static_cast<std::size_t>(k)];
    power[0] = -node[static_cast<std::size_t>(i)] * power[0] + coefficient[static_cast<std::size_t>(i)];
  }
  return {power.begin(), power.end()};
}

/// Rounds the taps to about a millionth. Settings whose rows differ only by rounding then have the same filter and share the
/// draws of noise.
std::vector<float> rounded(std::vector<float> filter) {
  constexpr float steps = 1 << 20;
  for (float& tap : filter) tap = std::round(tap * steps) / steps;
  return filter;
}

/// Sets the sample grid, and the pulse on it.
void lay_out_samples(PingPlan& p) {
  const PingSettings& s = p.settings;
  // Sample n lies at device range (n + sample_offset) spacing, at time 2 r / c_dev.
  const double c_dev = static_cast<double>(s.device_sound_speed_mps);
  p.samples = s.range_bin_count * s.samples_per_row;
  p.sample_spacing_m = s.range_bin_m / s.samples_per_row;
  p.start_samples = s.range_start_m / p.sample_spacing_m;
  p.sample_offset = p.start_samples + (0.5 + (s.row_centre - 0.5) * s.samples_per_row);
  p.sample_time_s = 2 * p.sample_spacing_m / c_dev;

  const Waveform& waveform = p.mode.waveform;
  p.pulse_width_m = static_cast<double>(s.pulse_width_m);
  p.pulse_shape = Pulse(waveform, 2 * p.pulse_width_m / c_dev);
  if (waveform.shape == Waveform::Shape::measured) p.pulse_width_m = p.pulse_shape.width_s() * c_dev / 2;
  p.envelope_hz = envelope_parameter_hz(c_dev, p.pulse_width_m);
  p.taps = taps_of(p.pulse_shape, p.sample_time_s);
  if (!p.expected_power && (waveform.exact || !p.pulse_shape.is_real()))
    p.spectral = std::make_shared<const SpectralColumns>(p.pulse_shape, p.sample_time_s, p.samples, p.taps);
  else
    p.pulse_rows = make_pulse_rows(p.pulse_shape, p.sample_time_s, p.taps, p.pulse_steps, p.expected_power);
}

void fill_row_gains(PingPlan& plan) {
  plan.row_power_factor.clear();
  plan.row_gain.clear();
  const PingSettings& s = plan.settings;
  const auto tvg = [&](int row) {
    return s.tvg ? tvg_db(plan.mode.receiver, s.range_of_row(row), static_cast<double>(s.device_absorption_db_per_m)) : 0.0;
  };
  const double smallest = tvg(0);
  for (int row = 0; row < s.range_bin_count; ++row) {
    double gain_db = static_cast<double>(s.gain_db) + tvg(row);
    double extra = 1;
    if (s.format.row_gains) {
      plan.row_gain.push_back(row_power_gain(tvg(row), smallest));
      gain_db = static_cast<double>(s.gain_db) + smallest;
      extra = plan.row_gain.back();
    }
    // Eq. 36 and 37: (gain TVG / full scale)^2, because the receiver works on powers.
    const double factor = full_scale_factor(plan.mode.receiver, gain_db);
    plan.row_power_factor.push_back(static_cast<float>(factor * factor * extra));
  }
}

void fill_channel_gains(PingPlan& p) {
  const std::vector<float>& gain_db = p.mode.receiver.channel_gain_db;
  const std::size_t beams = p.beam_sine.size();
  for (std::size_t j = 0; j < beams && p.switches.uneven && !gain_db.empty(); ++j)
    p.beam_power_factor.push_back(static_cast<float>(power_from_db(static_cast<double>(gain_db[j * gain_db.size() / beams]))));
}

void lay_out_noise_profile(PingPlan& p) {
  const BeamProfile& profile = p.mode.receiver.profile;
  if (!p.switches.uneven || profile.noise_db.empty()) return;
  const double top = half_aperture_sine(p.mode);
  for (int k = 0; k < p.columns.count; ++k) {
    const double reported = p.columns.sine(k) / p.bearing_scale;
    const double far = power_from_db(at_sine(profile.noise_db, reported, top));
    const double near = profile.near_noise_db.empty() ? far : power_from_db(at_sine(profile.near_noise_db, reported, top));
    p.noise_profile.far.push_back(static_cast<float>(far));
    p.noise_profile.near_less_far.push_back(static_cast<float>(near - far));
  }
  // Smaller decays change the noise by less than 0.05 dB, because near noise exceeds far noise by at most about 10 dB.
  constexpr double least = 1e-3;
  for (int n = 0; n < p.samples && !profile.near_noise_db.empty(); ++n) {
    const double decay = std::exp(-(n + p.sample_offset) * p.sample_spacing_m / static_cast<double>(profile.near_m));
    if (decay < least) break;
    p.noise_profile.decay.push_back(static_cast<float>(decay));
  }
}

/// If delays are computed for another sound speed, the sines of the beams change in proportion. Columns move with the beams;
/// their transmit amplitudes do not change.
void scale_beam_sines(PingPlan& p) {
  p.columns.first_sine *= p.bearing_scale, p.columns.spacing *= p.bearing_scale;
  for (double& u : p.beam_sine) u = std::clamp(u * p.bearing_scale, -1.0, 1.0);
  for (int k = 0; k < p.columns.count; ++k)
    if (std::abs(p.columns.sine(k)) >= 1) p.columns.transmit[static_cast<std::size_t>(k)] = 0;
}

void lay_out_fixed_fan(PingPlan& p) {
  const double step_rad = 2 * p.fan.half_angle_rad / p.fixed_fan;
  const bool has_pattern = p.mode.pattern.elevation_taper != Taper::unit;
  const double aperture = has_pattern ? elevation_aperture_in_wavelengths(p.mode.pattern) : 0;
  for (int ray = 0; ray < p.fixed_fan; ++ray) {
    const double angle = (ray + 0.5) * step_rad - p.fan.half_angle_rad, cosine = std::cos(angle);
    const double pattern = has_pattern ? elevation_two_way(aperture, angle) : 1.0;
    // dOmega = du dpsi for cones. For flat beams it is cos(psi) dtheta dpsi; scatter_hits applies the factor that depends on
    // the column.
    const double solid_angle = p.columns.spacing * step_rad * (p.switches.conical ? 1.0 : cosine);
    p.fixed_fan_rays.push_back({static_cast<float>(angle), static_cast<float>(cosine), static_cast<float>(std::sin(angle)),
                                static_cast<float>(pattern * std::sqrt(solid_angle))});
  }
}

}  // namespace

std::vector<double> make_beam_sines(const FrequencyMode& mode, int beam_count) {
  std::vector<double> sines;
  if (mode.beam_spacing == BeamSpacing::listed) {
    for (const double azimuth : mode.beam_azimuths_rad) sines.push_back(std::sin(azimuth));
    return sines;
  }
  const double half = static_cast<double>(mode.horizontal_aperture_rad) / 2;
  for (int j = 0; j < beam_count; ++j) {
    if (mode.beam_spacing == BeamSpacing::uniform_in_sine)
      sines.push_back(beam_count > 1 ? std::sin(half) * (1 - 2.0 * j / (beam_count - 1)) : 0.0);
    else
      sines.push_back(std::sin(half * (1 - (2.0 * j + 1) / beam_count)));
  }
  return sines;
}

Columns make_columns(const FrequencyMode& mode, int beam_count) {
  const double top = half_aperture_sine(mode);
  const auto [narrowest, width] = beam_width_sines(mode);
  // If beams are uniform in the sine, they lie on column centres, so that one row of weights is enough for all beams.
  // The column spacing divides the beam spacing, and is at most 0.35 of a beam width (docs/acoustics.md, section 2).
  const double beam_spacing = 2 * top / std::max(beam_count - 1, 1);
  const double per_beam = std::ceil(beam_spacing / (widest_column_in_beams * narrowest) - 1e-9);
  Columns c;
  c.spacing = beam_spacing / std::max(per_beam, 1.0);
  const int margin = static_cast<int>(std::ceil(margin_in_beams * width / c.spacing));
  const int inside = static_cast<int>(std::lround(2 * top / c.spacing)) + 1;
  c.count = inside + 2 * margin;
  c.first_sine = top + margin * c.spacing;
  for (int k = 0; k < c.count; ++k) {
    const double beyond = (std::abs(c.sine(k)) - top) / width;
    // T(u): falls as cos^2 from 1.5 to 3 beam widths beyond the sector.
    const double fall = std::clamp((beyond - flat_margin_in_beams) / (margin_in_beams - flat_margin_in_beams), 0.0, 1.0);
    c.transmit.push_back(std::abs(c.sine(k)) < 1 ? static_cast<float>(std::pow(std::cos(pi / 2 * fall), 2)) : 0.0f);
  }
  return c;
}

std::optional<std::size_t> PingPlan::column_of(const ConicalDirection& direction, double half_angle_rad) const {
  const double column = std::floor((columns.first_sine - direction.u) / columns.spacing + 0.5);
  if (std::abs(direction.psi_rad) > half_angle_rad || !(column >= 0) || column >= columns.count) return {};
  return static_cast<std::size_t>(column);
}

double PingPlan::widest_about_axis_rad(double half_angle_rad) const {
  if (switches.conical) return half_angle_rad;
  const double sine = std::min(columns.first_sine + columns.spacing, 0.9999);
  return std::atan(std::tan(half_angle_rad) / std::sqrt(1 - sine * sine));
}

void PingPlan::aim(CellView& view) const {
  view.max_sine = static_cast<float>(std::min(1.0, columns.first_sine + columns.spacing));
  view.max_elevation_rad = static_cast<float>(widest_about_axis_rad(fan.reach_rad));
  view.levels = levels;
  view.exact_small = expected_power;
  if (fan.side_elevations == 0) return;
  view.main_elevation_rad = static_cast<float>(widest_about_axis_rad(fan.half_angle_rad));
  view.side_from_rad = static_cast<float>(fan.half_angle_rad);
  // Few cells per sample are enough if speckle hides the positions of the cells.
  const double cells_a_sample = expected_power ? side_cells_of_expected_power : side_cells_of_speckle;
  view.side_area_per_range_m = static_cast<float>(narrowest_beam_rad(mode) * pulse_width_m / cells_a_sample);
  view.side_coarser = expected_power ? 0 : 2;
}

double device_wavelength_m(const FrequencyMode& mode, const PingSettings& settings) {
  return static_cast<double>(settings.device_sound_speed_mps) / static_cast<double>(mode.centre_hz);
}

PingPlan make_plan(const FrequencyMode& mode, const PingSettings& settings, const Switches& switches, Parallel& pool,
                   double bearing_scale) {
  PingPlan p;
  p.mode = mode;
  p.settings = settings;
  p.switches = switches;
  p.expected_power = switches.expected_power;
  p.fixed_fan = switches.fixed_fan;
  p.bearing_scale = bearing_scale;
  p.columns = make_columns(mode, settings.beam_count);
  p.beam_sine = make_beam_sines(mode, settings.beam_count);
  for (const double u : p.beam_sine) p.beam_azimuth_rad.push_back(static_cast<float>(std::asin(u)));
  if (bearing_scale != 1) scale_beam_sines(p);
  p.beam_pattern = receive_patterns(mode, p.beam_sine.size());
  FrequencyMode formed = mode;  // without `interleave`, one ping forms all beams
  if (!switches.interleave) formed.interleaved_pings = 1;
  p.beam_weights = make_beam_weights(formed, p.columns, p.beam_sine, p.expected_power);
  lay_out_samples(p);
  p.fan = make_fan(mode, settings, p.pulse_width_m, switches.side_lobes);
  lay_out_fixed_fan(p);
  p.elevation = fit_elevation(mode, p.fan.half_angle_rad);
  // The mean over speckle does not hide the random positions of the cells. Smaller cells reduce their effect to a tenth of a
  // decibel.
  const double cell_scale = p.expected_power ? 0.4 : 1.0;
  p.levels = make_cell_levels(cell_scale * p.pulse_width_m, cell_scale * narrowest_beam_rad(mode), settings.range_m * 1.1);
  p.pulse_filter = p.noise_filter = rounded(make_noise_filter(p.pulse_shape, p.sample_time_s));
  double bandwidth_hz = p.pulse_shape.noise_bandwidth_hz();
  if (const auto width = static_cast<double>(mode.receiver.noise_width); switches.bandwidth && width != 1) {
    const Pulse passed(mode.waveform, width * 2 * p.pulse_width_m / static_cast<double>(settings.device_sound_speed_mps));
    p.noise_filter = rounded(make_noise_filter(passed, p.sample_time_s));
    bandwidth_hz = passed.noise_bandwidth_hz();
  }
  // A beam has sum_k W_jk^2 times the power of a column. This must equal NL (eq. 30).
  p.column_noise_upa = noise_rms_upa(mode, bandwidth_hz) / std::sqrt(p.beam_weights.weight_energy);
  lay_out_noise_profile(p);
  p.shared_noise = SharedNoiseTable(p, pool);
  p.beam_mix = BeamMix(p);
  fill_row_gains(p);
  fill_channel_gains(p);
  return p;
}

PingPlan make_plan(const FrequencyMode& mode, const PingSettings& settings, const Switches& switches, double bearing_scale) {
  Parallel alone;
  return make_plan(mode, settings, switches, alone, bearing_scale);
}

void set_gain(PingPlan& plan, float gain_db) {
  if (plan.settings.gain_db == gain_db) return;
  plan.settings.gain_db = gain_db;
  fill_row_gains(plan);
}

bool serves(const PingPlan& plan, const PingRequest& r) {
  PingSettings requested = r.settings;  // below, the values that are not compared are set to the plan's
  requested.rate_hz = plan.settings.rate_hz;
  requested.gain_db = plan.settings.gain_db;
  requested.gain_assist = plan.settings.gain_assist;
  requested.triggered = plan.settings.triggered;
  requested.transmit = plan.settings.transmit;
  return requested == plan.settings && plan.switches == r.switches && plan.bearing_scale == bearing_scale_of(r) &&
         plan.mode.name == r.model->modes[static_cast<std::size_t>(requested.mode)].name;
}

std::vector<CellLevel> make_cell_levels(double pulse_width_m, double beam_width_rad, double max_range_m) {
  const int coarsest = static_cast<int>(std::ceil(-std::log2(pulse_width_m) - 1e-9));
  constexpr double level_fade = 1.15;  // levels cross-fade over 15 % of the range
  constexpr double nearest_m = 0.2;    // no image begins at a shorter range; all nearer cells have the same level
  std::vector<CellLevel> levels;
  double coarser_begins = 2 * max_range_m;  // range at which the next coarser level begins
  for (int level = coarsest;; ++level) {
    // From this range on, a cell is at most a third of a beam wide: 2^-level <= r theta / 3.
    const double begins = 3 * std::ldexp(1.0, -level) / beam_width_rad;
    const bool finest = begins < nearest_m || level - coarsest > 10;
    CellLevel l;
    l.level = level;
    l.fade_in_from_m = finest ? 0.0f : static_cast<float>(begins);
    l.full_from_m = finest ? 0.0f : static_cast<float>(begins * level_fade);
    l.full_to_m = static_cast<float>(coarser_begins);
    l.fade_out_to_m = static_cast<float>(coarser_begins * level_fade);
    if (begins < max_range_m || finest) levels.push_back(l);
    if (finest) break;
    if (begins < max_range_m) coarser_begins = begins;
  }
  return levels;
}

}  // namespace sonar
