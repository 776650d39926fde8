// Stage three: sums pulses in time for each column, at the sample centres (docs/acoustics.md, section 4). The pulse has a
// formula, so that it is evaluated only at samples, without sums over frequencies or a transform.
#pragma once

#include "core/pipeline/noise.hpp"
#include "core/pipeline/ping_plan.hpp"
#include "core/pipeline/signals.hpp"

namespace sonar {

/// Zeroes columns [first, last).
void clear_columns(ColumnSignals& signals, int first, int last);

/// Sets columns [first, last) to zero, or to the noise where the transmitter's pattern is 1, which saves a second pass over these
/// columns.
void begin_columns(const PingPlan& plan, const PingNoise& noise, int first, int last, ColumnSignals& signals);
/// Adds the pulses of the echoes, whose columns must lie in [first_column, ...) of `signals`.
void synthesize(Echoes& echoes, const simd::PulseRows& pulse, const simd::Kernels& kernels, ColumnSignals& signals);
/// Applies the transmitter's pattern to columns [first, last) and adds the noise that begin_columns did not.
void finish_columns(const PingPlan& plan, const PingNoise& noise, int first, int last, ColumnSignals& signals);

}  // namespace sonar
