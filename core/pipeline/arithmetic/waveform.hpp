// The Gaussian pulse p(t) = exp(-b^2 t^2) after the receiver's filter, and the widths that follow from it.
// Used by synthesis, shaped noise and level predictions (docs/acoustics.md, section 4). C++17-clean, standard library only.
#pragma once

#include <cmath>

#include "core/base/geometry.hpp"
#include "core/base/host_device.hpp"

namespace sonar {

/// sqrt(ln 2 / 2) = 0.58871: b t at which the intensity p^2 has fallen to one half.
inline constexpr double half_power_bt = 0.58870501125773734;

/// b [1/s] of the pulse whose -3 dB intensity width is `pulse_width_m` in one-way range at sound speed c: 0.5887 c / width.
/// Take the c the width was specified with; b is a property of the signal in time.
SONAR_HD inline double envelope_parameter_hz(double sound_speed_mps, double pulse_width_m) {
  return half_power_bt * sound_speed_mps / pulse_width_m;
}
/// The inverse: -3 dB intensity width in range [m].
SONAR_HD inline double pulse_range_width_m(double sound_speed_mps, double b_hz) { return half_power_bt * sound_speed_mps / b_hz; }

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
/// B_n: bandwidth of the rectangular filter that passes as much white noise as the pulse's filter, |P|^2 / |P(0)|^2 [Hz].
SONAR_HD inline double noise_bandwidth_hz(double b_hz) { return b_hz / std::sqrt(2 * pi); }
/// Complex sample rate of the fine grid, F_s = 2 b.
SONAR_HD inline double native_sample_rate_hz(double b_hz) { return 2 * b_hz; }
/// Correlation of noise shaped by p between samples `time_s` apart: exp(-(b t)^2 / 2).
SONAR_HD inline double noise_correlation(double b_hz, double time_s) {
  const double x = b_hz * time_s;
  return std::exp(-0.5 * x * x);
}

}  // namespace sonar
