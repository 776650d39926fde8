// Stage four: the receive pattern across columns makes beams (docs/acoustics.md, section 6): s_j[n] = sum_k W_jk g_k[n],
// W signed and not normalised further. Works on a window of samples, so that what it reads and writes stays in cache.
#pragma once

#include <span>
#include <vector>

#include "core/pipeline/ping_plan.hpp"
#include "core/pipeline/scatter.hpp"
#include "core/pipeline/synthesize.hpp"

namespace sonar {

/// Complex beam signals of samples [first_sample, first_sample + samples), interleaved; in expected power, re is a power.
struct BeamSignals {
  int beams = 0, first_sample = 0, samples = 0;
  std::ptrdiff_t stride = 0;  // floats from beam to beam
  std::vector<float> data;
  const float* beam(int j) const { return data.data() + j * stride; }
  float* beam(int j) { return data.data() + j * stride; }
};

/// Buffers of couple, one per worker.
struct CoupleScratch {
  std::vector<float> window;  // the columns' samples side by side, of a band
  AlignedFloats transform;    // the line of a transform
};

void couple(const ColumnSignals& columns, const Coupling& coupling, const simd::Kernels& kernels, int first_sample, int samples,
            int beams, CoupleScratch& scratch, BeamSignals& out);

/// Point echoes at their exact direction, on top. In expected power they are summed coherently among themselves.
void add_points(std::span<const PointEcho> points, const PingPlan& plan, BeamSignals& out);

}  // namespace sonar
