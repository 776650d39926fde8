// Formulas for pulses p(t) after the receiver's filter (Gaussian, rectangular tone, linear sweep), and for their widths.
// See docs/acoustics.md, section 4. The file uses only C++17 and the standard library.
#pragma once

#include <cmath>

#include "core/base/geometry.hpp"
#include "core/base/host_device.hpp"
#include "core/pipeline/arithmetic/beam_pattern.hpp"

namespace sonar {

/// sqrt(ln 2 / 2) = 0.58871: the value of b t at which the intensity p^2 has fallen to one half.
inline constexpr double half_power_bt = 0.58870501125773734;

/// b [1/s] of the pulse whose -3 dB intensity width is `pulse_width_m` in one-way range at sound speed c: 0.5887 c / width.
/// Pass the c for which the width was specified, because b is a property of the signal in time.
SONAR_HD inline double envelope_parameter_hz(double sound_speed_mps, double pulse_width_m) {
  return half_power_bt * sound_speed_mps / pulse_width_m;
}

/// p(t), p(0) = 1.
SONAR_HD inline double envelope(double b_hz, double time_s) {
  const double x = b_hz * time_s;
  return std::exp(-x * x);
}
/// P(nu) = integral of p(t) e^{-i 2 pi nu t} dt [s].
SONAR_HD inline double envelope_spectrum_s(double b_hz, double frequency_offset_hz) {
  const double x = pi * frequency_offset_hz / b_hz;
  return std::sqrt(pi) / b_hz * std::exp(-x * x);
}
/// tau_eff = integral of p^2 dt [s].
SONAR_HD inline double energy_width_s(double b_hz) { return std::sqrt(0.5 * pi) / b_hz; }
/// B_n [Hz]: bandwidth of the rectangular filter that passes as much white noise as the pulse's filter, |P|^2 / |P(0)|^2.
SONAR_HD inline double noise_bandwidth_hz(double b_hz) { return b_hz / std::sqrt(2 * pi); }
/// Complex sample rate of the fine grid, F_s = 2 b.
SONAR_HD inline double native_sample_rate_hz(double b_hz) { return 2 * b_hz; }
/// Correlation of noise shaped by p between samples `time_s` apart: exp(-(b t)^2 / 2).
SONAR_HD inline double noise_correlation(double b_hz, double time_s) {
  const double x = b_hz * time_s;
  return std::exp(-0.5 * x * x);
}

/// Rectangular tone of length T after its matched filter: a triangle that reaches T to either side of its peak.
SONAR_HD inline double tone_envelope(double length_s, double time_s) {
  const double x = std::fabs(time_s) / length_s;
  return x < 1 ? 1 - x : 0;
}
/// Spectrum of tone_envelope(): T sinc^2(nu T) [s].
SONAR_HD inline double tone_envelope_spectrum_s(double length_s, double frequency_offset_hz) {
  const double d = sinc(frequency_offset_hz * length_s);
  return length_s * d * d;
}
/// -3 dB width in delay, divided by the tone's length: 2 - sqrt 2. As a range, the width is 0.293 c T.
inline constexpr double tone_width_per_length = 0.58578643762690485;

/// A linear sweep over the bandwidth B after its matched filter with a Hamming window. It is the transform of 0.54 + 0.46 cos(2
/// pi nu / B). Its side lobes start at -42.6 dB and fall as 1 / t. They fade out between 24 / B and 48 / B; without the fade
/// they would be at -60 dB at 48 / B.
SONAR_HD inline double sweep_envelope(double bandwidth_hz, double time_s) {
  constexpr double fade_from = 24, over_at = 48, neighbour = 0.23 / 0.54;
  const double x = std::fabs(bandwidth_hz * time_s);
  if (x >= over_at) return 0;
  const double p = sinc(x) + neighbour * (sinc(x - 1) + sinc(x + 1));
  const double fade = x > fade_from ? std::cos(0.5 * pi * (x - fade_from) / (over_at - fade_from)) : 1.0;
  return p * fade * fade;
}
inline constexpr double sweep_reach = 48;  // p(t) = 0 from here on, in 1 / B
/// -3 dB width in delay, multiplied by B.
inline constexpr double sweep_width_times_bandwidth = 1.3029820808162345;

}  // namespace sonar
