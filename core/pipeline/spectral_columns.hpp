// Synthesis of columns via the spectrum, for pulses without a table of real values and for the exact mode (docs/acoustics.md,
// section 4). Steps: echoes -> sums over frequencies -> times P(nu) -> values at the sample centres. It replaces `synthesize`.
#pragma once

#include "core/pipeline/pulses/pulse.hpp"
#include "core/pipeline/pulses/spectral.hpp"
#include "core/pipeline/signals.hpp"

namespace sonar {

/// The sums of one worker for one group of columns.
struct SpectralScratch {
  std::vector<spectral::Complex> grids;  // grids of the columns of a group
  std::vector<spectral::Complex> sums, folded;
};

/// The period is longer than the record by at least the length of a pulse, so that pulses beyond one end do not appear at the
/// other end. The frequencies are the multiples of 1 / period in the pulse's band. The period is a whole number of samples, and
/// the spectrum is folded to this number of values. Therefore the inverse transform gives the samples themselves. The error is
/// that of FrequencySums at width 6, 1e-5.
class SpectralColumns {
 public:
  /// `taps`: number of samples of a pulse, as in PingPlan::taps. Every pulse is possible, but `synthesize` is faster for real
  /// ones.
  SpectralColumns(const Pulse& pulse, double sample_time_s, int samples, int taps);

  int period_samples() const { return period_; }
  int frequencies() const { return sums_.count(); }
  const spectral::FrequencySums& sums() const { return sums_; }
  /// Factor of every sum: spectrum of the pulse divided by the period.
  std::span<const spectral::Complex> response() const { return response_; }
  std::size_t bytes() const;  // approximate

  void begin(int columns, SpectralScratch& scratch) const;
  /// Adds the echoes to the grids. Their columns must lie within the columns passed to begin(), from first_column on.
  void add(Echoes& echoes, int first_column, SpectralScratch& scratch) const;
  /// Adds the resulting samples to columns [first, last) of `signals`.
  void finish(int first, int last, SpectralScratch& scratch, ColumnSignals& signals) const;

 private:
  int samples_, period_;
  spectral::FrequencySums sums_;
  spectral::Fft inverse_;
  std::vector<spectral::Complex> response_;  // P(nu_m) / period, per sum
};

}  // namespace sonar
