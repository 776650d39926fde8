// Stage three: sums pulses in time for each column, at the sample centres (docs/acoustics.md, section 4). The pulse has a
// formula, so it is evaluated only at samples. No sums over frequencies and no transform are needed.
#pragma once

#include "core/pipeline/noise.hpp"
#include "core/pipeline/ping_plan.hpp"
#include "core/pipeline/signals.hpp"

namespace sonar {

/// Sets columns [first, last) to zero.
void clear_columns(ColumnSignals& signals, int first, int last);

/// Sets columns [first, last) to zero, or to the noise where the transmitter's pattern is 1. Such columns need no second pass
/// for the noise.
void begin_columns(const PingPlan& plan, const PingNoise& noise, int first, int last, ColumnSignals& signals);
/// Adds the pulses of the echoes to their columns of `signals`, and removes the echoes.
void synthesize(Echoes& echoes, const simd::PulseRows& pulse, const simd::Kernels& kernels, ColumnSignals& signals);
/// Applies the transmitter's pattern to columns [first, last) and adds the noise that begin_columns did not.
void finish_columns(const PingPlan& plan, const PingNoise& noise, int first, int last, ColumnSignals& signals);

}  // namespace sonar
