// Stage four: forms beams from columns (docs/acoustics.md, section 6, eq. 9): s_j[n] = sum_k W_jk g_k[n]. Weights are signed
// and not normalised. The stage works on a window of samples, so that inputs and outputs stay in the cache.
#pragma once

#include <span>
#include <vector>

#include "core/pipeline/interleaved_pings.hpp"
#include "core/pipeline/ping_plan.hpp"
#include "core/pipeline/signals.hpp"

namespace sonar {

/// Buffers of form_beams, one object for each worker.
struct BeamScratch {
  std::vector<float> window;  // copies of the samples of all columns, for panels of weights
  AlignedFloats transform;    // working memory of a beam transform
};

/// Computes the samples of the window for which `out` has been shaped.
void form_beams(const ColumnSignals& columns, const BeamWeights& beam_weights, const simd::Kernels& kernels, BeamScratch& scratch,
                BeamSignals& out);
/// Forms only some beams; the others are undefined. `used`: the columns that these beams use (columns_of()); others are not
/// read.
void form_beams(const ColumnSignals& columns, const BeamWeights& beam_weights, BeamChoice wanted,
                std::span<const ColumnRange> used, const simd::Kernels& kernels, BeamScratch& scratch, BeamSignals& out);

/// The part of the point's pulse that lies within the samples [from, to).
SampledPulse place_pulse(const PointEcho& point, const PingPlan& plan, int from, int to);
/// Adds point echoes to the beams, each in its exact direction. In expected power, the point echoes of a beam are summed
/// coherently with each other.
void add_points(std::span<const PointEcho> points, const PingPlan& plan, BeamSignals& out);

}  // namespace sonar
