// Kernel bodies for pulses without a table of real values. They spread echoes on a grid, multiply the grid's transform by the
// spectrum of the pulse, fold the product, and make samples from its inverse transform (core/pipeline/spectral_columns.hpp).
// The Machine computes the two transforms between these steps.
#pragma once

#include <cmath>

#include "cuda/device_types.hpp"

namespace sonar::cuda {

/// Adds a column's echoes at the grid's points = part modulo spread_parts, where i = column * spread_parts + part. The order is
/// that of the CPU.
SONAR_HD inline void spread(const PingView& p, std::uint32_t i) {
  const SpectralView& s = p.spectral;
  const std::uint32_t k = i / spread_parts;
  const int part = static_cast<int>(i % spread_parts), parts = static_cast<int>(spread_parts);
  double* grid = s.grids + 2 * static_cast<std::int64_t>(k) * s.points;
  for (int at = part; at < s.points; at += parts) grid[2 * at] = grid[2 * at + 1] = 0;
  if (p.slots == 0) return;
  const Echo* echo = p.sorted + p.column_at[k];
  const Echo* const end = echo + p.in_column[k];
  for (; echo != end; ++echo) {
    const double turns = static_cast<double>(echo->sample) / s.period;
    const double place = (turns - std::floor(turns)) * s.points;
    const double first = std::ceil(place - 0.5 * s.width);
    const double t = 2 * (first - place + 0.5 * s.width) - 1;
    int at = static_cast<int>(first);
    if (at < 0) at += s.points;
    for (int tap = 0; tap < s.width; ++tap, ++at) {
      if (at >= s.points) at -= s.points;
      if (at % parts != part) continue;
      const double* c = s.kernel + tap;
      double value = c[0];
      for (int term = 1; term < s.terms; ++term) value = value * t + c[term * s.padded];
      grid[2 * at] += value * static_cast<double>(echo->re);
      grid[2 * at + 1] += value * static_cast<double>(echo->im);
    }
  }
}

/// Computes value `i` of [columns][period]: the sum of all frequencies that are folded to it, the lowest first.
SONAR_HD inline void fold(const PingView& p, std::uint32_t i) {
  const SpectralView& s = p.spectral;
  const auto period = static_cast<std::uint32_t>(s.period);
  const double* grid = s.grids + 2 * static_cast<std::int64_t>(i / period) * s.points;
  const int half = s.frequencies / 2;
  double re = 0, im = 0;
  for (int m = (static_cast<int>(i % period) + half) % s.period; m < s.frequencies; m += s.period) {
    const int at = m < half ? m - half + s.points : m - half;
    const double a = s.correction[m] * grid[2 * at], b = s.correction[m] * grid[2 * at + 1];
    const double c = s.response[2 * m], d = s.response[2 * m + 1];
    re += a * c - b * d;
    im += a * d + b * c;
  }
  s.folded[2 * static_cast<std::int64_t>(i)] = re;
  s.folded[2 * static_cast<std::int64_t>(i) + 1] = im;
}

/// Computes sample `i` of [columns][samples].
SONAR_HD inline void unfold(const PingView& p, std::uint32_t i) {
  const auto samples = static_cast<std::uint32_t>(p.samples);
  const double* from = p.spectral.folded + 2 * (static_cast<std::int64_t>(i / samples) * p.spectral.period + i % samples);
  p.signals[2 * static_cast<std::int64_t>(i)] = static_cast<float>(from[0]);
  p.signals[2 * static_cast<std::int64_t>(i) + 1] = static_cast<float>(from[1]);
}

}  // namespace sonar::cuda
