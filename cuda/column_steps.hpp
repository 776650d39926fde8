// Kernel bodies that complete the columns' signals: multipath, volume reverberation, the transmitter's pattern, receiver noise
// and leak. simulate() (core/pipeline/cpu/simulate.cpp) adds the noise first; therefore its sums differ from these by rounding.
#pragma once

#include <cmath>

#include "core/pipeline/arithmetic/noise_place.hpp"
#include "cuda/device_types.hpp"

namespace sonar::cuda {

struct Complex {
  float re = 0, im = 0;
};

/// Adds `rms` times sample `n` of the noise whose first sample is at `place` in the table.
SONAR_HD inline void add_noise(const float* table, const NoisePlace& place, std::uint32_t n, float rms, Complex& to) {
  const float* from = table + 2 * static_cast<std::int64_t>((place.first + n) % noise_table_samples);
  const float sign = place.negative ? -rms : rms;
  if (place.quarter) {
    to.re -= sign * from[1];
    to.im += sign * from[0];
  } else {
    to.re += sign * from[0];
    to.im += sign * from[1];
  }
}

SONAR_HD inline NoisePlace place_of(const NoiseKey& key, std::uint32_t sonar, std::uint32_t ping, std::uint32_t column) {
  return noise_place(key.seed, sonar, ping, column);
}

/// Adds multipath to sample `i` of [columns][samples].
SONAR_HD inline void add_multipath(const PingView& p, std::uint32_t i) {
  const auto samples = static_cast<std::uint32_t>(p.samples);
  const float* from = p.multipath + (i / samples) * p.multipath_stride + 2 * static_cast<std::int64_t>(i % samples);
  p.signals[2 * static_cast<std::int64_t>(i)] += from[0];
  p.signals[2 * static_cast<std::int64_t>(i) + 1] += from[1];
}

/// Adds volume reverberation to column `k`. At each sample it removes the slices of the fan that end there at a surface.
SONAR_HD inline void volume(const PingView& p, std::uint32_t k) {
  const SeaView& s = p.sea;
  const auto columns = static_cast<std::int64_t>(s.columns);
  const float* map = p.depth + static_cast<std::int64_t>(k) * (s.bins + 1);
  const double u = p.column_u[k], rest = 1 - u * u;
  const double per_x = s.conical != 0 ? 1 / std::sqrt(rest > 1e-12 ? rest : 1e-12) : 1;
  double* blocked = p.blocked + k;
  for (int n = 0; n < p.samples; ++n) blocked[n * columns] = 0;
  for (int i = 0; i < p.slice_count; ++i) {
    const VolumeSlice& slice = p.slices[i];
    const auto inverse_x = static_cast<double>(map[slice.bin]);
    if (!(inverse_x > 0)) continue;
    // Computes the sample at which this slice of the fan ends at a surface.
    const double sample = per_x * slice.range_per_x / inverse_x * p.volume_samples_per_m - p.volume_sample_offset;
    if (sample < static_cast<double>(p.samples))
      blocked[static_cast<std::int64_t>(sample > 0 ? sample : 0.0) * columns] += slice.weight;
  }
  const NoisePlace place = place_of(p.noise_key, p.noise_key.sonar, p.noise_key.ping, first_volume_column + k);
  float* signal = p.signals + 2 * static_cast<std::int64_t>(k) * p.samples;
  double open = p.open_fan;
  for (int n = 0; n < p.samples; ++n) {
    open -= blocked[n * columns];
    if (!(open > 0)) open = 0;
    const double power = p.open_power[n] * open * p.column_width[k];
    if (s.expected_power != 0) {
      signal[2 * n] += static_cast<float>(power);
      continue;
    }
    Complex grain;
    add_noise(p.grain_table, place, static_cast<std::uint32_t>(n), 1, grain);
    const auto rms = static_cast<float>(std::sqrt(power));
    signal[2 * n] += rms * grain.re;
    signal[2 * n + 1] += rms * grain.im;
  }
}

/// Applies the transmitter's pattern to sample `i` of [columns][samples], and adds noise and leak.
SONAR_HD inline void finish_columns(const PingView& p, std::uint32_t i) {
  const auto samples = static_cast<std::uint32_t>(p.samples);
  const std::uint32_t k = i / samples, n = i % samples;
  const bool power = p.sea.expected_power != 0;
  float* at = p.signals + 2 * static_cast<std::int64_t>(i);
  Complex s{at[0], at[1]};
  const float amplitude = p.transmit[k];
  if (amplitude != 1.0f) {
    const float factor = power ? amplitude * amplitude : amplitude;
    s.re *= factor;
    s.im *= factor;
  }
  const NoiseKey& key = p.noise_key;
  if (p.has_noise != 0) {
    float rms = p.noise_rms;
    if (p.noise_far != nullptr)
      rms *= std::sqrt(p.noise_far[k] +
                       (static_cast<std::int64_t>(n) < p.noise_decays ? p.noise_near_less_far[k] * p.noise_decay[n] : 0.0f));
    if (power)
      s.re += rms * rms;
    else
      add_noise(p.noise_table, place_of(key, key.sonar, key.ping, k), n, rms, s);
  }
  if (static_cast<std::int32_t>(n) < p.leak_samples) {
    const float rms = p.leak_rms[n];
    if (power) {
      s.re += rms * rms * (p.leak_steady * p.leak_steady + p.leak_changing * p.leak_changing);
    } else {
      Complex grain;
      if (p.leak_steady > 0)
        add_noise(p.grain_table, place_of(key, leak_sonar(key.sonar), every_ping, k), n, p.leak_steady, grain);
      add_noise(p.grain_table, place_of(key, leak_sonar(key.sonar), key.ping, k), n, p.leak_changing, grain);
      s.re += rms * grain.re;
      s.im += rms * grain.im;
    }
  }
  at[0] = s.re;
  at[1] = s.im;
}

}  // namespace sonar::cuda
