// Stage four: beams from columns (docs/acoustics.md, section 6, eq. 9): s_j[n] = sum_k W_jk g_k[n], W signed and not normalised
// further. Works on a window of samples, so that what it reads and writes stays in cache.
#pragma once

#include <span>
#include <vector>

#include "core/pipeline/ping_plan.hpp"
#include "core/pipeline/signals.hpp"

namespace sonar {

/// Buffers of form_beams, one per worker.
struct BeamScratch {
  std::vector<float> window;  // the columns' samples side by side, of a band
  AlignedFloats transform;    // the line of a transform
};

/// Fills the window of samples that `out` has been shaped for.
void form_beams(const ColumnSignals& columns, const BeamWeights& beam_weights, const simd::Kernels& kernels, BeamScratch& scratch,
                BeamSignals& out);

/// The point's pulse on samples [from, to), as far as it reaches.
SampledPulse place_pulse(const PointEcho& point, const PingPlan& plan, int from, int to);
/// Point echoes at their exact direction, on top. In expected power they are summed coherently among themselves.
void add_points(std::span<const PointEcho> points, const PingPlan& plan, BeamSignals& out);

}  // namespace sonar
