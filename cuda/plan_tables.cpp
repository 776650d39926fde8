#include "cuda/plan_tables.hpp"

#include <algorithm>
#include <cmath>

#include "core/pipeline/arithmetic/receiver.hpp"
#include "core/pipeline/spectral_columns.hpp"
#include "core/sonar/bearings.hpp"

namespace sonar::cuda {

PlanTables::PlanTables(Machine& machine, int lane, const PingRequest& request)
    : model_(request.model),
      seed_(request.seed),
      plan_(make_plan(request.model->modes[static_cast<std::size_t>(request.settings.mode)], request.settings, request.switches,
                      bearing_scale_of(request))),
      memory_(machine, Arena::Where::both, 1u << 20),
      noise_memory_(machine, Arena::Where::both, 0) {
  const PingPlan& p = plan_;
  // Eq. 11: u and sqrt(1 - u^2) in float for the rays, which only determine shadows; u in double for the volume reverberation.
  std::vector<ColumnSine> sines;
  std::vector<double> u;
  for (int k = 0; k < p.columns.count; ++k) {
    u.push_back(p.columns.sine(k));
    sines.push_back({static_cast<float>(u.back()), static_cast<float>(std::sqrt(std::max(0.0, 1 - u.back() * u.back())))});
  }
  // Elevations about the array axis [rad] (docs/acoustics.md, section 2).
  std::vector<BaseElevation> base;
  for (const float angle : p.fan.elevation_rad) base.push_back({angle, std::cos(angle), std::sin(angle)});
  // Eq. 9: bands of weights, four beams for each panel. The device does not use the beam transform.
  const BeamWeights weights = p.beam_weights.transform ? make_beam_weights(p.mode, p.columns, p.beam_sine, p.expected_power,
                                                                           {.dropped_energy = 0, .transform = false})
                                                       : p.beam_weights;
  std::vector<BeamWeightRow> rows;
  for (const BeamPanel& panel : weights.panels)
    rows.push_back({panel.first_column, panel.count, static_cast<std::uint32_t>(panel.weights), 0});

  view_.column_sines = memory_.put(sines);
  view_.base_elevations = memory_.put(base);
  view_.pulse_rows = memory_.put(p.pulse_rows);
  view_.transmit = memory_.put(p.columns.transmit);
  view_.weights = memory_.put(weights.weights);
  view_.panels = memory_.put(rows);
  view_.beam_sines = memory_.put(p.beam_sine);
  view_.column_u = memory_.put(u);
  view_.beam_patterns = memory_.put(p.beam_pattern);
  view_.taps = p.taps;
  view_.pulse_steps = p.pulse_steps;
  view_.samples = p.samples;
  view_.per_row = p.settings.samples_per_row;
  view_.rows = p.settings.range_bin_count;
  view_.beams = p.settings.beam_count;
  view_.max_code = p.settings.format.max_code;
  view_.code_factor = static_cast<float>(p.settings.format.max_code) + (p.truncates() ? 1.0f : 0.0f);
  view_.code_rounding = p.truncates() ? 0.0f : 0.5f;
  view_.half_gamma = p.settings.format.gamma / 2;
  // Eq. 40 as a straight line in log2 of the power.
  const LevelLine line = level_line(p.settings.format);
  view_.per_octave = static_cast<float>(line.per_octave);
  view_.at_full_scale = static_cast<float>(line.at_full_scale);
  view_.logarithmic = p.settings.format.scale == SampleFormat::Scale::logarithmic ? 1 : 0;
  view_.bytes_a_sample = p.settings.format.bits / 8;
  if (!p.beam_power_factor.empty()) view_.beam_power_factor = memory_.put(p.beam_power_factor);
  if (!p.noise_profile.is_even()) {
    view_.noise_far = memory_.put(p.noise_profile.far);
    view_.noise_near_less_far = memory_.put(p.noise_profile.near_less_far);
    view_.noise_decay = memory_.put(p.noise_profile.decay);
    view_.noise_decays = static_cast<std::int64_t>(p.noise_profile.decay.size());
  }
  if (p.shared_noise.is_audible()) {
    view_.shared_noise = memory_.put(p.shared_noise.response());
    view_.shared_rms = memory_.put(p.shared_noise.noise_upa());
    view_.shared_leak = memory_.put(p.shared_noise.leak_upa());
    view_.shared_samples = p.shared_noise.samples();
    view_.shared_steady = memory_.put(p.shared_noise.steady_upa());
    view_.shared_parts = static_cast<std::uint32_t>(p.shared_noise.parts());
  }
  view_.mix = p.beam_mix.view();
  if (p.beam_mix.blurs()) view_.mix.turn_m = memory_.put(p.beam_mix.turn_m());
  view_.mix.taps = memory_.put(p.beam_mix.taps());
  view_.mix.reach = memory_.put(p.beam_mix.reach());
  if (p.beam_mix.blends()) view_.mix.own = memory_.put(p.beam_mix.own());
  view_.mix.share = memory_.put(p.beam_mix.share());
  // Tables for pulses without a table of rows (eq. 25).
  if (p.spectral) add_spectrum(*p.spectral);
  memory_.upload(lane);
}

void PlanTables::add_spectrum(const SpectralColumns& s) {
  const spectral::FrequencySums::Tables t = s.sums().tables();
  SpectralView& v = view_.spectral;
  v.points = s.sums().grid_points();
  v.period = s.period_samples();
  v.frequencies = s.frequencies();
  // The width of eq. 26, the number of terms of its polynomials, and their padding to whole vectors.
  v.width = t.width, v.terms = t.terms, v.padded = t.padded;
  v.kernel = memory_.put(t.polynomial);
  v.correction = memory_.put(t.correction);
  // Eq. 25: P(nu_m) / period, interleaved.
  std::vector<double> response;
  for (const spectral::Complex& r : s.response()) response.push_back(r.real()), response.push_back(r.imag());
  v.response = memory_.put(response);
}

bool PlanTables::serves(const PingRequest& request) const {
  // The tables depend on the seed because of the noise table.
  return model_ == request.model && seed_ == request.seed && sonar::serves(plan_, request);
}

void PlanTables::need_noise(int lane) {
  // The tables are made when a ping first needs them. They stay on the device with the plan.
  if (view_.noise_table) return;
  noise_.prepare(seed_, plan_.noise_filter);
  view_.noise_table = view_.grain_table = noise_memory_.put(noise_.shaped());
  if (plan_.pulse_filter != plan_.noise_filter) {
    grains_.prepare(seed_, plan_.pulse_filter);
    view_.grain_table = noise_memory_.put(grains_.shaped());
  }
  noise_memory_.upload(lane);
}

void PlanTables::fill(PingView& view) const { view = view_; }

}  // namespace sonar::cuda
