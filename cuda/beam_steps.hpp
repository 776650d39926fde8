// Kernel bodies that compute codes from columns: the receive pattern, the pulses of points and of other sonars, crosstalk,
// envelope, gain and quantisation. They compute the same values as form_beams, interference and receive (core/pipeline).
#pragma once

#include <cmath>
#include <cstring>

#include "cuda/column_steps.hpp"

namespace sonar::cuda {

// The device loads such a struct with one instruction.
struct alignas(8) Pair {
  float re, im;
};
struct alignas(16) Four {
  float of[4];
};
/// Reads a Vector at `from`, which must be aligned to alignof(Vector).
template <class Vector>
SONAR_HD inline Vector load_aligned(const float* from) {
#if defined(__CUDA_ARCH__)
  return *reinterpret_cast<const Vector*>(from);
#else
  Vector v;
  std::memcpy(&v, from, sizeof v);
  return v;
#endif
}

/// Computes weight `i` of [points and pulses][beams].
SONAR_HD inline void point_weights(const PingView& p, std::uint32_t i) {
  const auto beams = static_cast<std::uint32_t>(p.beams);
  const std::uint32_t point = i / beams;
  const auto points = static_cast<std::uint32_t>(p.point_count);
  const PulseInBeams& from = point < points ? p.points[point] : p.pulses[point - points];
  p.point_weights[i] = p.beam_patterns[i % beams](from.sine - p.beam_sines[i % beams]);
}

/// Adds the pulses of points at sample `n` of beam `j`.
SONAR_HD inline void add_points(const PingView& p, std::uint32_t j, std::int32_t n, float& re, float& im) {
  const auto beams = static_cast<std::uint32_t>(p.beams);
  const bool power = p.sea.expected_power != 0;
  double sum_re = 0, sum_im = 0;
  for (int q = 0; q < p.point_count; ++q) {
    const PulseInBeams& point = p.points[q];
    if (n < point.from || n >= point.to) continue;
    const double w = p.point_weights[static_cast<std::uint32_t>(q) * beams + j];
    sum_re += w * point.values[2 * (n - point.from)];
    sum_im += w * point.values[2 * (n - point.from) + 1];
  }
  re += static_cast<float>(power ? sum_re * sum_re + sum_im * sum_im : sum_re);
  if (!power) im += static_cast<float>(sum_im);
}
/// Adds the pulses of other sonars at sample `n` of beam `j`.
SONAR_HD inline void add_pulses(const PingView& p, std::uint32_t j, std::int32_t n, float& re, float& im) {
  const auto beams = static_cast<std::uint32_t>(p.beams);
  const bool power = p.sea.expected_power != 0;
  for (int q = 0; q < p.pulse_count; ++q) {
    const PulseInBeams& pulse = p.pulses[q];
    if (n < pulse.from || n >= pulse.to) continue;
    const double w = p.point_weights[static_cast<std::uint32_t>(p.point_count + q) * beams + j];
    const double a = pulse.values[2 * (n - pulse.from)], b = pulse.values[2 * (n - pulse.from) + 1];
    re += static_cast<float>(power ? w * w * (a * a + b * b) : w * a);
    if (!power) im += static_cast<float>(w * b);
  }
}

/// Adds the noise and leak that channels share at sample `n` of beam `j`.
SONAR_HD inline void add_shared_noise(const PingView& p, std::uint32_t j, std::int32_t n, float& re, float& im) {
  if (p.shared_noise == nullptr || n >= p.shared_samples) return;
  const bool noise = p.has_noise != 0;
  const float rms = noise ? p.shared_rms[n] : 0.0f;
  const float steady = (noise ? p.shared_steady[n] : 0.0f) + (n < p.shared_leak_samples ? p.shared_leak[n] : 0.0f);
  const NoiseKey& key = p.noise_key;
  float sum_re = 0, sum_im = 0;
  for (std::uint32_t part = 0; part < p.shared_parts; ++part) {
    const float* r = p.shared_noise + 2 * (static_cast<std::int64_t>(part) * p.beams + j) * p.shared_samples + n;
    const float r_re = r[0], r_im = r[p.shared_samples];
    const bool changes = part + 1 < p.shared_parts;
    const float level = changes ? rms : steady;
    if (p.sea.expected_power != 0) {
      sum_re += level * level * (r_re * r_re + r_im * r_im);
      continue;
    }
    Complex c{changes ? 0 : steady, 0};
    if (changes && noise)
      add_noise(p.noise_table, place_of(key, key.sonar, key.ping, first_shared_noise_column + part),
                static_cast<std::uint32_t>(n), rms, c);
    sum_re += c.re * r_re - c.im * r_im;
    sum_im += c.re * r_im + c.im * r_re;
  }
  re += sum_re;
  im += sum_im;
}

/// Computes the sums of one sample over columns, for the beams of `panels` panels that have the same columns. `weight`: weights
/// of each panel.
template <std::uint32_t panels>
SONAR_HD inline void sum_over_columns(const float* const* weight, const float* column, std::int64_t stride, std::int32_t count,
                                      float* re, float* im) {
  for (std::int32_t k = 0; k < count; ++k) {
    const Pair s = load_aligned<Pair>(column);
    for (std::uint32_t panel = 0; panel < panels; ++panel) {
      const Four w = load_aligned<Four>(weight[panel] + static_cast<std::int64_t>(beams_a_panel) * k);
      for (std::uint32_t beam = 0; beam < beams_a_panel; ++beam) {
        re[panel * beams_a_panel + beam] += w.of[beam] * s.re;
        im[panel * beams_a_panel + beam] += w.of[beam] * s.im;
      }
    }
    column += stride;
  }
}

/// Computes sample `i` of [pairs of panels][samples], for the eight beams of two panels. The two panels mostly have the same
/// columns, so that each sample is read once for all eight beams.
SONAR_HD inline void form_beams(const PingView& p, std::uint32_t i) {
  const auto samples = static_cast<std::uint32_t>(p.samples), beams = static_cast<std::uint32_t>(p.beams);
  const std::uint32_t panels = (beams + beams_a_panel - 1) / beams_a_panel;
  const std::uint32_t first = i / samples * panels_at_once;
  const auto n = static_cast<std::int32_t>(i % samples);
  constexpr std::uint32_t at_once = panels_at_once * beams_a_panel;
  float re[at_once] = {}, im[at_once] = {};
  const float* weight[panels_at_once];
  const BeamWeightRow& row = p.panels[first];
  const BeamWeightRow& other = p.panels[first + 1 < panels ? first + 1 : first];
  weight[0] = p.weights + row.weights;
  weight[1] = p.weights + other.weights;
  const std::int64_t stride = 2 * static_cast<std::int64_t>(p.samples);
  const float* const sample = p.signals + 2 * static_cast<std::int64_t>(n);
  if (row.first_column == other.first_column && row.count == other.count) {
    sum_over_columns<2>(weight, sample + row.first_column * stride, stride, row.count, re, im);
  } else {
    sum_over_columns<1>(weight, sample + row.first_column * stride, stride, row.count, re, im);
    sum_over_columns<1>(weight + 1, sample + other.first_column * stride, stride, other.count, re + beams_a_panel,
                        im + beams_a_panel);
  }
  for (std::uint32_t beam = 0; beam < at_once; ++beam) {
    const std::uint32_t j = first * beams_a_panel + beam;
    if (j >= beams) break;
    add_points(p, j, n, re[beam], im[beam]);
    if (p.mixed == nullptr) {  // otherwise refocus() and blend() add them later
      add_pulses(p, j, n, re[beam], im[beam]);
      add_shared_noise(p, j, n, re[beam], im[beam]);
    }
    float* to = p.beam_signals + 2 * (static_cast<std::int64_t>(j) * p.samples + n);
    to[0] = re[beam];
    to[1] = im[beam];
  }
}

/// Blurs sample `i` of [beams][samples], and adds the pulses of other sonars. Reads the beams, writes `mixed`.
SONAR_HD inline void refocus(const PingView& p, std::uint32_t i) {
  const auto j = static_cast<std::int32_t>(i / static_cast<std::uint32_t>(p.samples));
  const auto n = static_cast<std::int32_t>(i % static_cast<std::uint32_t>(p.samples));
  const float* from = p.beam_signals + 2 * static_cast<std::int64_t>(i);
  MixedSample s{from[0], from[1]};
  if (p.mix.turn_m != nullptr)
    if (const std::int32_t set = focus_set(p.mix, j, n); set > 0)
      s = refocused(p.mix, p.beam_signals, 2 * static_cast<std::int64_t>(p.samples), j, n, set);
  add_pulses(p, static_cast<std::uint32_t>(j), n, s.re, s.im);
  float* to = p.mixed + 2 * static_cast<std::int64_t>(i);
  to[0] = s.re;
  to[1] = s.im;
}
/// Blends sample `i`, and adds shared noise. Reads `mixed`, writes the beams.
SONAR_HD inline void blend(const PingView& p, std::uint32_t i) {
  const auto j = static_cast<std::int32_t>(i / static_cast<std::uint32_t>(p.samples));
  const auto n = static_cast<std::int32_t>(i % static_cast<std::uint32_t>(p.samples));
  const float* from = p.mixed + 2 * static_cast<std::int64_t>(i);
  MixedSample s{from[0], from[1]};
  if (p.mix.own != nullptr) s = blended(p.mix, p.mixed, 2 * static_cast<std::int64_t>(p.samples), j, n);
  add_shared_noise(p, static_cast<std::uint32_t>(j), n, s.re, s.im);
  float* to = p.beam_signals + 2 * static_cast<std::int64_t>(i);
  to[0] = s.re;
  to[1] = s.im;
}

/// Computes the sum over all beams of sample `n`.
SONAR_HD inline void crosstalk_sum(const PingView& p, std::uint32_t n) {
  float re = 0, im = 0;
  for (int j = 0; j < p.beams; ++j) {
    const float* s = p.beam_signals + 2 * (static_cast<std::int64_t>(j) * p.samples + n);
    re += s[0];
    im += s[1];
  }
  p.crosstalk[2 * n] = re;
  p.crosstalk[2 * n + 1] = im;
}
/// Adds crosstalk to sample `i` of [beams][samples].
SONAR_HD inline void crosstalk_add(const PingView& p, std::uint32_t i) {
  const std::uint32_t n = i % static_cast<std::uint32_t>(p.samples);
  float* s = p.beam_signals + 2 * static_cast<std::int64_t>(i);
  s[0] = p.crosstalk_own * s[0] + p.crosstalk_leaked * p.crosstalk[2 * n];
  s[1] = p.crosstalk_own * s[1] + p.crosstalk_leaked * p.crosstalk[2 * n + 1];
}

/// Computes sample `i` of [rows][beams].
SONAR_HD inline void receive(const PingView& p, std::uint32_t i) {
  const auto beams = static_cast<std::uint32_t>(p.beams);
  const std::uint32_t row = i / beams, j = i % beams;
  const std::int64_t first = static_cast<std::int64_t>(row) * p.per_row;
  const float* s = p.beam_signals + 2 * (static_cast<std::int64_t>(j) * p.samples + first);
  float sum = 0;
  for (int q = 0; q < p.per_row; ++q) {
    sum += p.sea.expected_power != 0 ? s[2 * q] : s[2 * q] * s[2 * q] + s[2 * q + 1] * s[2 * q + 1];
    if (p.kept_beams == nullptr) continue;
    float* kept = p.kept_beams + 2 * ((first + q) * p.beams + j);
    kept[0] = s[2 * q];
    kept[1] = s[2 * q + 1];
  }
  float power = sum / static_cast<float>(p.per_row);
  if (p.pressure != nullptr) p.pressure[i] = std::sqrt(power);
  if (p.beam_power_factor != nullptr) power *= p.beam_power_factor[j];
  const auto max_code = static_cast<float>(p.max_code);
  // Eq. 37 and 40, as in codes_of and quantise_levels (core/pipeline/simd/quantise.inl).
  const float octaves = log2_of(larger(power * p.row_power_factor[row], 1e-30f));
  const float code = p.logarithmic != 0
                         ? std::floor(smaller(larger(p.per_octave * octaves + (p.at_full_scale + 0.5f), 0.0f), max_code))
                         : smaller(std::floor(exp2_of(p.half_gamma * octaves) * p.code_factor + p.code_rounding), max_code);
  // 2^32 - 1 is not representable as a float. The comparison comes before the conversion, because the conversion could
  // overflow.
  const std::uint32_t whole = code >= max_code ? p.max_code : static_cast<std::uint32_t>(code);
  std::uint8_t* out = p.codes + static_cast<std::int64_t>(i) * p.bytes_a_sample;
  for (int b = 0; b < p.bytes_a_sample; ++b) out[b] = static_cast<std::uint8_t>(whole >> (8 * b) & 0xFFu);
}

}  // namespace sonar::cuda
