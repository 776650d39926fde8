#include "core/pipeline/interference.hpp"

#include <algorithm>
#include <cmath>

#include "core/base/random.hpp"
#include "core/base/units.hpp"
#include "core/pipeline/arithmetic/beam_pattern.hpp"
#include "core/pipeline/arithmetic/noise_place.hpp"
#include "core/pipeline/arithmetic/scattering.hpp"
#include "core/pipeline/arithmetic/waveform.hpp"

namespace sonar {
namespace {

constexpr double no_crosstalk_db = -150;
constexpr int most_pulses = 64;        // limit for one other sonar in one ping
constexpr double edge_widths = 3;      // erf differs from 1 by 2e-5 there
constexpr double widest_offset = 0.2;  // largest offset of another sonar's tone from our carrier, as a fraction of b

double unit_uniform(std::uint32_t bits) { return static_cast<double>(bits) / 4294967296.0; }

/// The step response of the Gaussian filter, 0 to 1; `x` is b t.
double rise(double x) { return 0.5 * (1 + std::erf(x)); }

}  // namespace

double Leak::reach_m(const ReceiverModel& law) {
  if (!(law.leak_upa > 0)) return 0;
  if (!law.leak_ring_db.empty())
    return static_cast<double>(law.leak_ring_step_m) * static_cast<double>(law.leak_ring_db.size() - 1);
  return most_leak_decay_db / static_cast<double>(law.leak_decay_db_per_m);
}

/// docs/acoustics.md, eq. 31: rms(r) = leak_upa 10^(-decay r / 20), or from a table, at a beam's output. The rms in a column is
/// this value divided by sqrt(sum_k W_jk^2), like the noise.
Leak::Leak(const PingPlan& plan, const Switches& switches) {
  const ReceiverModel& law = plan.mode.receiver;
  if (!switches.leak || !(law.leak_upa > 0)) return;
  steady_ = plan.shared_noise.has_leak() ? 0.0f : static_cast<float>(steady_part);
  const double per_column = static_cast<double>(law.leak_upa) / std::sqrt(plan.beam_weights.weight_energy);
  for (int n = 0; n < plan.samples; ++n) {
    const double range_m = (n + plan.sample_offset) * plan.sample_spacing_m;
    double down_db = static_cast<double>(law.leak_decay_db_per_m) * range_m;
    if (!law.leak_ring_db.empty()) {
      const double at = range_m / static_cast<double>(law.leak_ring_step_m);
      const auto i = static_cast<std::size_t>(at);
      if (i + 1 >= law.leak_ring_db.size()) break;
      down_db = -std::lerp(static_cast<double>(law.leak_ring_db[i]), static_cast<double>(law.leak_ring_db[i + 1]),
                           at - static_cast<double>(i));
    } else if (down_db > most_leak_decay_db) {
      break;
    }
    rms_upa_.push_back(static_cast<float>(per_column * amplitude_from_db(-down_db)));
  }
}

void Leak::add(const PingPlan& plan, const PingNoise& noise, int first, int last, ColumnSignals& signals) const {
  const std::size_t n = rms_upa_.size();
  std::vector<float> grain(2 * n);
  const auto changing = static_cast<float>(changing_part);
  for (int k = first; k < last; ++k) {
    float* to = signals.column(k) + 2 * signals.lead;
    if (plan.expected_power) {
      const float share = steady_ * steady_ + changing * changing;
      for (std::size_t i = 0; i < n; ++i) to[2 * i] += share * rms_upa_[i] * rms_upa_[i];
      continue;
    }
    // The leak has a steady and a changing part, whose powers add to 1.
    std::fill(grain.begin(), grain.end(), 0.0f);
    const int count = static_cast<int>(n);
    if (steady_ > 0) noise.table->add(leak_sonar(noise.sonar), every_ping, k, steady_, count, grain.data());
    noise.table->add(leak_sonar(noise.sonar), noise.ping, k, changing, count, grain.data());
    for (std::size_t i = 0; i < n; ++i) {
      to[2 * i] += rms_upa_[i] * grain[2 * i];
      to[2 * i + 1] += rms_upa_[i] * grain[2 * i + 1];
    }
  }
}

std::vector<ReceivedPulse> receive_other_sonars(const PingContext& context, const PingRequest& request) {
  const PingPlan& plan = context.plan;
  const PingScalars& s = context.scalars;
  std::vector<ReceivedPulse> received;
  if (!request.switches.interference || request.blank) return received;
  const RandomKey key = key_of(request.seed, Domain::other_sonar), of_pulses{key.high, key.low, key.domain};
  // The receiver's Gaussian filter has b t = 0.5887 at the pulse's half width; its step response is rise(b t).
  const double per_sample = 2 * half_power_bt * plan.sample_spacing_m / plan.pulse_width_m;
  const double samples_per_s = s.sound_speed_mps / 2 * s.samples_per_m;
  const double fired_s = seconds(request.fired_at.time_since_epoch());
  const std::vector<OtherSonar>& others = context.scene().other_sonars;
  for (std::size_t i = 0; i < others.size(); ++i) {
    const OtherSonar& other = others[i];
    // Eq. 32: level / r e^{-a r} of the one-way path, times the root of the two-way elevation pattern.
    const double range_m = length(other.position_m - request.sonar_in_world.position_m);
    if (!(other.rate_hz > 0) || !(other.level_upa > 0) || range_m < nearest_scatterer_m) continue;
    if (is_occluded(context.rays, request.sonar_in_world.position_m, other.position_m)) continue;
    const Random4 draw = philox(static_cast<std::uint32_t>(i), request.sonar_id, 0, key);
    const double rate_hz = static_cast<double>(other.rate_hz), travel_s = range_m / s.sound_speed_mps;
    // Pulse number n, counted from time 0, arrives at (n + phase) / rate + travel. `first` is the first pulse that may reach
    // into the record.
    const double phase = unit_uniform(draw.v[0]), pulse_s = static_cast<double>(other.pulse_s);
    const double edge_samples = edge_widths / per_sample;
    const double earliest_s = (plan.start_samples - edge_samples) / samples_per_s - pulse_s;
    const double first = std::ceil((fired_s + earliest_s - travel_s) * rate_hz - phase);
    for (int p = 0; p < most_pulses; ++p) {
      const double at_s = (first + p + phase) / rate_hz + travel_s - fired_s;  // time after our firing
      ReceivedPulse pulse;
      pulse.from_sample = at_s * samples_per_s - s.sample_offset;
      if (pulse.from_sample - edge_samples > plan.samples) break;
      pulse.to_sample = pulse.from_sample + pulse_s * samples_per_s;
      const Pose now = s.moves ? propagate(request.sonar_in_world, s.twist, at_s) : request.sonar_in_world;
      const Vec3d seen = transform(inverse(now), other.position_m);
      if (seen.x <= 0) continue;
      const ConicalDirection from = plan.direction_of(seen);
      const double both_ways =
          elevation_two_way(plan.mode.pattern, from.psi_rad);  // two equal patterns; only the pattern of our receiver counts here
      pulse.sine = from.u;
      pulse.amplitude_upa = static_cast<double>(other.level_upa) / range_m * std::exp(-s.absorption_np_per_m * range_m) *
                            std::sqrt(std::max(both_ways, 0.0));
      const Random4 own = philox(static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(static_cast<std::int64_t>(first) + p),
                                 request.sonar_id, of_pulses);
      // The carrier phase at arrival, and a carrier offset of up to widest_offset b. Both are hashed.
      pulse.phase_turns = unit_uniform(own.v[0]);
      pulse.turns_per_sample = widest_offset * (2 * unit_uniform(draw.v[1]) - 1) * per_sample;
      pulse.edge_per_sample = per_sample;
      received.push_back(pulse);
    }
  }
  return received;
}

SampledPulse tone_of(const ReceivedPulse& pulse, int from, int to) {
  const double soft = edge_widths / pulse.edge_per_sample;
  SampledPulse tone;
  tone.first_sample = std::max(from, static_cast<int>(std::ceil(std::max(pulse.from_sample - soft, 0.0))));
  const int end = static_cast<int>(std::min(std::floor(pulse.to_sample + soft) + 1, static_cast<double>(to)));
  for (int n = tone.first_sample; n < end; ++n) {
    // A tone after the filter: its two ends have the shape of the step response.
    const double level =
        rise((n - pulse.from_sample) * pulse.edge_per_sample) * rise((pulse.to_sample - n) * pulse.edge_per_sample);
    const double turns = pulse.phase_turns + (n - pulse.from_sample) * pulse.turns_per_sample;
    tone.values.push_back(std::polar(pulse.amplitude_upa * level, 2 * pi * turns));
  }
  return tone;
}

void add_pulses(std::span<const ReceivedPulse> pulses, const PingPlan& plan, BeamSignals& beams) {
  for (const ReceivedPulse& pulse : pulses) {
    const auto [from, tone] = tone_of(pulse, beams.first_sample, beams.first_sample + beams.samples);
    if (tone.empty()) continue;
    for (int j = 0; j < beams.beams; ++j) {
      // W(u - u_j) with all side lobes (eq. 9).
      const auto beam = static_cast<std::size_t>(j);
      const double weight = plan.beam_pattern[beam](pulse.sine - plan.beam_sine[beam]);
      float* out = beams.beam(j) + 2 * (from - beams.first_sample);
      for (const std::complex<double>& t : tone) {
        out[0] += static_cast<float>(plan.expected_power ? weight * weight * std::norm(t) : weight * t.real());
        if (!plan.expected_power) out[1] += static_cast<float>(weight * t.imag());
        out += 2;
      }
    }
  }
}

Crosstalk::Crosstalk(const PingPlan& plan, const Switches& switches) {
  const double level_db = static_cast<double>(plan.mode.receiver.crosstalk_db);
  if (!switches.crosstalk || level_db < no_crosstalk_db) return;
  amplitude_ = amplitude_from_db(level_db);
  // Eq. 35: beam j becomes own s_j + e share sum_i s_i. For a single echo, the sum over beams is its amplitude divided by
  // `share`.
  // For a single echo in the middle of the sector, the sum over all beams is sum_j W_j, or in power sum_j W_j^2.
  const double middle = plan.beam_sine[plan.beam_sine.size() / 2];
  double sum = 0, squares = 0;
  for (std::size_t j = 0; j < plan.beam_sine.size(); ++j) {
    const double w = plan.beam_pattern[j](middle - plan.beam_sine[j]);
    sum += w;
    squares += w * w;
  }
  share_ = 1 / (plan.expected_power ? squares : sum);
  own_in_power_ = 2 * sum / squares;
}

Crosstalk::Mix Crosstalk::mix(bool expected_power) const {
  // In power, the cross term of a beam with its own leakage is 2 e sum W / sum W^2, and the leaked power is e^2.
  return {static_cast<float>(expected_power ? 1 + amplitude_ * own_in_power_ : 1.0),
          static_cast<float>((expected_power ? amplitude_ * amplitude_ : amplitude_) * share_)};
}

void Crosstalk::add(const PingPlan& plan, BeamSignals& beams) const {
  const auto floats = static_cast<std::size_t>(2 * beams.samples);
  // Computes the sum over all beams for each sample, and then adds the sum to each beam.
  std::vector<float> sum(floats, 0.0f);
  for (int j = 0; j < beams.beams; ++j) {
    const float* from = beams.beam(j);
    for (std::size_t i = 0; i < floats; ++i) sum[i] += from[i];
  }
  const auto [own, leaked] = mix(plan.expected_power);
  for (int j = 0; j < beams.beams; ++j) {
    float* to = beams.beam(j);
    for (std::size_t i = 0; i < floats; ++i) to[i] = own * to[i] + leaked * sum[i];
  }
}

}  // namespace sonar
