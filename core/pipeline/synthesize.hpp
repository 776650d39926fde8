// Stage three: pulses summed in time, per column, at the sample centres (docs/acoustics.md, section 4). The pulse is analytic, so
// it is evaluated only where a row takes its sample; no frequency loop and no transform is needed.
#pragma once

#include <cstddef>

#include "core/base/aligned.hpp"
#include "core/pipeline/noise.hpp"
#include "core/pipeline/ping_plan.hpp"
#include "core/pipeline/scatter.hpp"

namespace sonar {

/// Complex signals per column at the sample centres, interleaved; in expected power, re is a power.
struct ColumnSignals {
  int columns = 0, samples = 0;
  int lead = 0;               // samples of room before sample 0, for pulses that begin earlier
  std::ptrdiff_t stride = 0;  // floats from column to column
  AlignedFloats data;         // so is every column, on a cache line

  void shape(int column_count, int sample_count, int taps);
  float* column(int k) { return data.data() + k * stride; }
  const float* first_sample(int k) const { return data.data() + k * stride + 2 * lead; }
};

/// Zeroes columns [first, last).
void clear_columns(ColumnSignals& signals, int first, int last);

/// A ping's receiver noise; `table` null = none.
struct ReceiverNoise {
  const NoiseTable* table = nullptr;
  std::uint32_t sonar = 0, ping = 0;
};
/// Empty columns [first, last): zero, or where the transmitter's pattern is 1 the noise already, which saves going over them
/// twice.
void begin_columns(const PingPlan& plan, const ReceiverNoise& noise, int first, int last, ColumnSignals& signals);
/// Adds the pulses of the echoes, whose columns must lie in [first_column, ...) of `signals`.
void synthesize(Echoes& echoes, const simd::PulseRows& pulse, const simd::Kernels& kernels, ColumnSignals& signals);
/// Applies the transmitter's pattern to columns [first, last) and adds the noise that begin_columns did not.
void finish_columns(const PingPlan& plan, const ReceiverNoise& noise, int first, int last, ColumnSignals& signals);

}  // namespace sonar
