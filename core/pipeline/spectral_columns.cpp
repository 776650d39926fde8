#include "core/pipeline/spectral_columns.hpp"

#include <algorithm>
#include <cmath>

namespace sonar {
namespace {

// w of eq. 26; its relative L2 error is 8e-6.
constexpr int kernel_width = 6;

/// Number of frequencies per sample of the period. The pulse's band determines it.
int per_sample(const Pulse& pulse, double sample_time_s) {
  return std::max(1, static_cast<int>(std::ceil(pulse.band_hz() * sample_time_s)));
}

}  // namespace

// An echo up to half a pulse before the record extends into it. The pulse of an echo near the end extends half a pulse beyond
// it. Padding of one pulse length separates the two.
SpectralColumns::SpectralColumns(const Pulse& pulse, double sample_time_s, int samples, int taps)
    : samples_(samples),
      period_(spectral::quick_size(samples + taps + 2)),
      sums_(period_ * per_sample(pulse, sample_time_s), kernel_width),
      inverse_(period_, spectral::Fft::Direction::inverse) {
  // Frequencies [-count / 2, count / 2) / period about the carrier [Hz]; 1 / period is the scale of the inverse transform.
  const double period_s = period_ * sample_time_s;
  const int count = sums_.count();
  response_ = pulse.spectrum_s({-(count / 2) / period_s, 1 / period_s, count});
  for (spectral::Complex& r : response_) r /= period_s;
}

void SpectralColumns::begin(int columns, SpectralScratch& scratch) const {
  // The grids of a group of columns collect echoes until finish() transforms them.
  scratch.grids.assign(static_cast<std::size_t>(columns) * static_cast<std::size_t>(sums_.grid_points()), 0.0);
  scratch.sums.resize(static_cast<std::size_t>(sums_.count()));
}

void SpectralColumns::add(Echoes& echoes, int first_column, SpectralScratch& scratch) const {
  for (std::size_t i = 0; i < static_cast<std::size_t>(echoes.count); ++i) {
    const auto column = static_cast<std::size_t>(echoes.column[i] - first_column);
    const spectral::Complex amplitude(static_cast<double>(echoes.re[i]), static_cast<double>(echoes.im[i]));
    // The delay is in periods.
    sums_.add(static_cast<double>(echoes.sample[i]) / period_, amplitude,
              scratch.grids.data() + column * static_cast<std::size_t>(sums_.grid_points()));
  }
  echoes.count = 0;
}

void SpectralColumns::finish(int first, int last, SpectralScratch& scratch, ColumnSignals& signals) const {
  const int count = sums_.count();
  for (int k = first; k < last; ++k) {
    spectral::Complex* grid = scratch.grids.data() + static_cast<std::ptrdiff_t>(k - first) * sums_.grid_points();
    // docs/acoustics.md, eq. 25: F(nu_m) P(nu_m), folded to one value per sample and transformed back.
    sums_.transform(grid, scratch.sums.data());
    scratch.folded.assign(static_cast<std::size_t>(period_), 0.0);
    // Frequency m - count / 2 is folded to its remainder after division by the period.
    int place = (period_ - count / 2 % period_) % period_;
    for (int m = 0; m < count; ++m) {
      const auto i = static_cast<std::size_t>(m);
      scratch.folded[static_cast<std::size_t>(place)] += scratch.sums[i] * response_[i];
      if (++place == period_) place = 0;
    }
    inverse_.run(scratch.folded.data());
    float* to = signals.column(k) + 2 * signals.lead;
    for (int n = 0; n < samples_; ++n) {
      to[2 * n] += static_cast<float>(scratch.folded[static_cast<std::size_t>(n)].real());
      to[2 * n + 1] += static_cast<float>(scratch.folded[static_cast<std::size_t>(n)].imag());
    }
  }
}

std::size_t SpectralColumns::bytes() const {
  // A transform has about as many factors as it has values.
  const auto values = response_.capacity() + static_cast<std::size_t>(sums_.grid_points() + period_);
  return sizeof(spectral::Complex) * values + sizeof(double) * sums_.tables().correction.size();
}

}  // namespace sonar
