// Column synthesis by way of the spectrum, for pulses without a real table and for the exact mode (docs/acoustics.md, section 4):
// echoes -> sums over frequencies -> times P(nu) -> values at the sample centres. Stands where `synthesize` does otherwise.
#pragma once

#include "core/pipeline/pulses/pulse.hpp"
#include "core/pipeline/pulses/spectral.hpp"
#include "core/pipeline/signals.hpp"

namespace sonar {

/// One worker's sums, a group of columns at a time.
struct SpectralScratch {
  std::vector<spectral::Complex> grids;  // grids of the columns of a group
  std::vector<spectral::Complex> sums, folded;
};

/// The record is taken as one period of a longer one: padded by the pulse's reach on both sides, so that nothing that rings in
/// from beyond either end comes out at the other. Its frequencies are the multiples of 1 / period inside the pulse's band, and
/// since the samples are an even fraction of the period apart, folding the spectrum down to that many values makes the inverse
/// transform land on the samples themselves. Errors: of FrequencySums at width 6, 1e-5.
class SpectralColumns {
 public:
  /// `taps`: samples that a pulse may reach, as PingPlan::taps. For any pulse; real ones are cheaper in time.
  SpectralColumns(const Pulse& pulse, double sample_time_s, int samples, int taps);

  int period_samples() const { return period_; }
  int frequencies() const { return sums_.count(); }
  const spectral::FrequencySums& sums() const { return sums_; }
  /// Factor of every sum: the pulse's spectrum over the period.
  std::span<const spectral::Complex> response() const { return response_; }
  std::size_t bytes() const;  // about

  void begin(int columns, SpectralScratch& scratch) const;
  /// Takes the echoes in; their columns must lie in [first_column, first_column + columns of begin).
  void add(Echoes& echoes, int first_column, SpectralScratch& scratch) const;
  /// Adds what they make at the samples to columns [first, last) of `signals`.
  void finish(int first, int last, SpectralScratch& scratch, ColumnSignals& signals) const;

 private:
  int samples_, period_;
  spectral::FrequencySums sums_;
  spectral::Fft inverse_;
  std::vector<spectral::Complex> response_;  // P(nu_m) / period, per sum
};

}  // namespace sonar
