// Stage three: pulses summed in time, per column, at the sample centres (docs/acoustics.md, section 4). The pulse is analytic, so
// it is evaluated only where a row takes its sample; no frequency loop and no transform is needed.
#pragma once

#include "core/pipeline/noise.hpp"
#include "core/pipeline/ping_plan.hpp"
#include "core/pipeline/signals.hpp"

namespace sonar {

/// Zeroes columns [first, last).
void clear_columns(ColumnSignals& signals, int first, int last);

/// Empty columns [first, last): zero, or where the transmitter's pattern is 1 the noise already, which saves going over them
/// twice.
void begin_columns(const PingPlan& plan, const PingNoise& noise, int first, int last, ColumnSignals& signals);
/// Adds the pulses of the echoes, whose columns must lie in [first_column, ...) of `signals`.
void synthesize(Echoes& echoes, const simd::PulseRows& pulse, const simd::Kernels& kernels, ColumnSignals& signals);
/// Applies the transmitter's pattern to columns [first, last) and adds the noise that begin_columns did not.
void finish_columns(const PingPlan& plan, const PingNoise& noise, int first, int last, ColumnSignals& signals);

}  // namespace sonar
