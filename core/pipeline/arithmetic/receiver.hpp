// Converts beam pressure to samples: thermal noise level, time-varied gain, row gains, quantisation (docs/acoustics.md, section
// 7). The file uses only C++17 and the standard library.
#pragma once

#include <cmath>
#include <cstdint>

#include "core/base/geometry.hpp"
#include "core/base/host_device.hpp"
#include "core/sonar/ping_settings.hpp"
#include "core/sonar/sonar_model.hpp"

namespace sonar {

/// Thermal noise spectrum level, Mellen: -15 + 20 log10 f_kHz [dB re 1 uPa^2/Hz].
SONAR_HD inline double thermal_noise_db(double centre_hz) { return -15 + 20 * std::log10(centre_hz * 1e-3); }
/// DI = 10 log10(4 pi / (theta phi)), the directivity index [dB], with the nominal -3 dB widths [rad].
SONAR_HD inline double directivity_index_db(double azimuth_width_rad, double elevation_width_rad) {
  return 10 * std::log10(4 * pi / (azimuth_width_rad * elevation_width_rad));
}
/// NL at a beam's output [dB re 1 uPa] (docs/acoustics.md, eq. 30): NSL + 10 log B_n - DI + NF.
SONAR_HD inline double noise_level_db(const FrequencyMode& mode, double noise_bandwidth_hz) {
  return thermal_noise_db(static_cast<double>(mode.centre_hz)) + 10 * std::log10(noise_bandwidth_hz) -
         directivity_index_db(static_cast<double>(mode.pattern.azimuth_width_rad),
                              static_cast<double>(mode.pattern.elevation_width_rad)) +
         static_cast<double>(mode.receiver.noise_figure_db);
}
/// sqrt(E|s|^2) of the noise at a beam's output [uPa]. Before beamforming, the noise of a column is this value divided by
/// sqrt(sum_k W_jk^2).
SONAR_HD inline double noise_rms_upa(const FrequencyMode& mode, double noise_bandwidth_hz) {
  return std::pow(10.0, noise_level_db(mode, noise_bandwidth_hz) / 20);
}

/// Time-varied gain [dB] (docs/acoustics.md, eq. 36): X log10 r + 2 alpha r. r is at least the minimum range, and the gain is at
/// most the ceiling. `range_m` and `alpha_db_per_m` (one way) are the values that the device assumes.
SONAR_HD inline double tvg_db(const ReceiverModel& law, double range_m, double alpha_db_per_m) {
  const double floor_m = static_cast<double>(law.tvg_minimum_range_m), ceiling_db = static_cast<double>(law.tvg_ceiling_db);
  const double r = range_m > floor_m ? range_m : floor_m;
  const double gain_db = static_cast<double>(law.tvg_slope_db) * std::log10(r) + 2 * alpha_db_per_m * r;
  return gain_db < ceiling_db ? gain_db : ceiling_db;
}

/// Amplitude factor from pressure [uPa] to fractions of full scale, for a total gain [dB] (TVG + the client's gain).
SONAR_HD inline double full_scale_factor(const ReceiverModel& law, double gain_db) {
  return std::pow(10.0, gain_db / 20) / static_cast<double>(law.full_scale_upa);
}

/// Power gain of a row in formats that send it: the row's TVG divided by the smallest TVG, as a power ratio, rounded to an
/// integer, at least 1. The amplitude is multiplied by exactly sqrt(row gain), so that sample / sqrt(gain) restores the
/// amplitude.
SONAR_HD inline std::uint32_t row_power_gain(double row_tvg_db, double smallest_tvg_db) {
  const double gain = std::floor(std::pow(10.0, 0.1 * (row_tvg_db - smallest_tvg_db)) + 0.5);
  if (!(gain > 1)) return 1;
  return gain >= 4294967295.0 ? 4294967295u : static_cast<std::uint32_t>(gain);
}

/// Logarithmic codes as a straight line (eq. 40): code = per_octave log2(v^2) + at_full_scale, before rounding and clamping.
struct LevelLine {
  double per_octave = 0, at_full_scale = 0;
};
SONAR_HD inline LevelLine level_line(const SampleFormat& format) {
  const double floor_db = static_cast<double>(format.floor_db), span_db = static_cast<double>(format.ceiling_db) - floor_db;
  const double per_db = static_cast<double>(format.max_code) / span_db;
  return {10 * std::log10(2.0) * per_db, -floor_db * per_db};
}

/// Sample code of v = amplitude over full scale (eq. 37 and 40), at most max_code; 0 for NaN and negative values. `truncates`:
/// see ReceiverModel.
SONAR_HD inline std::uint32_t quantise(double v, const SampleFormat& format, bool truncates = false) {
  if (!(v > 0)) return 0;
  if (format.scale == SampleFormat::Scale::logarithmic) {
    const LevelLine line = level_line(format);
    const double code = 2 * line.per_octave * std::log2(v) + line.at_full_scale + 0.5;
    return !(code > 0) ? 0 : code >= static_cast<double>(format.max_code) ? format.max_code : static_cast<std::uint32_t>(code);
  }
  if (v >= 1) return format.max_code;
  const double gamma = static_cast<double>(format.gamma);
  const double shaped = gamma == 1 ? v : std::pow(v, gamma);
  const auto max_code = static_cast<double>(format.max_code);
  const double code = truncates ? (max_code + 1) * shaped : max_code * shaped + 0.5;
  return code < max_code ? static_cast<std::uint32_t>(code) : format.max_code;
}

}  // namespace sonar
