#include "core/pipeline/couple.hpp"

#include <algorithm>
#include <cmath>
#include <complex>

#include "core/pipeline/arithmetic/beam_pattern.hpp"
#include "core/pipeline/beam_transform.hpp"

namespace sonar {

void couple(const ColumnSignals& columns, const Coupling& coupling, const simd::Kernels& kernels, int first_sample, int samples,
            int beams, CoupleScratch& scratch, BeamSignals& out) {
  const int floats = (2 * samples + 31) / 32 * 32;
  out.beams = beams;
  out.first_sample = first_sample;
  out.samples = samples;
  out.stride = floats;
  out.data.resize(static_cast<std::size_t>(floats) * static_cast<std::size_t>((beams + 3) / 4 * 4));

  if (coupling.transform) {
    scratch.transform.resize(coupling.transform->work_floats());
    kernels.transform_beams(coupling.transform->tables(), columns.first_sample(0) + 2 * first_sample, columns.stride, floats,
                            scratch.transform.data(), out.data.data(), floats);
    return;
  }
  scratch.window.resize(static_cast<std::size_t>(floats) * static_cast<std::size_t>(columns.columns));
  for (int k = 0; k < columns.columns; ++k) {
    const float* from = columns.first_sample(k) + 2 * first_sample;
    std::copy(from, from + floats, scratch.window.data() + static_cast<std::ptrdiff_t>(k) * floats);
  }
  for (const CouplingPanel& panel : coupling.panels)
    kernels.couple_panel(scratch.window.data() + static_cast<std::ptrdiff_t>(panel.first_column) * floats, floats,
                         coupling.weights.data() + panel.weights, panel.count, out.beam(panel.first_beam), floats);
}

void add_points(std::span<const PointEcho> points, const PingPlan& plan, BeamSignals& out) {
  struct Reach {
    const PointEcho* point;
    int from, to;                            // samples of this window that its pulse touches
    std::vector<std::complex<double>> echo;  // its pulse there
  };
  std::vector<Reach> here;
  for (const PointEcho& point : points) {
    const int middle = static_cast<int>(std::floor(point.sample));
    const int from = std::max(middle - plan.taps / 2 + 1, out.first_sample);
    const int to = std::min(middle + plan.taps / 2 + 1, out.first_sample + out.samples);
    if (from >= to) continue;
    here.push_back({&point, from, to, {}});
    for (int n = from; n < to; ++n)
      here.back().echo.push_back(point.amplitude * plan.pulse_shape.at(plan.sample_time_s * (n - point.sample)));
  }
  if (here.empty()) return;

  const ReceivePattern pattern = receive_pattern(plan.mode.pattern);
  std::vector<std::complex<double>> sum;
  for (int j = 0; j < out.beams; ++j) {
    sum.assign(static_cast<std::size_t>(out.samples), 0.0);
    for (const Reach& r : here) {
      const double weight = pattern(r.point->sine - plan.beam_sine[static_cast<std::size_t>(j)]);
      for (int n = r.from; n < r.to; ++n)
        sum[static_cast<std::size_t>(n - out.first_sample)] += weight * r.echo[static_cast<std::size_t>(n - r.from)];
    }
    float* beam = out.beam(j);
    for (int n = 0; n < out.samples; ++n) {
      const std::complex<double> s = sum[static_cast<std::size_t>(n)];
      beam[2 * n] += static_cast<float>(plan.expected_power ? std::norm(s) : s.real());
      if (!plan.expected_power) beam[2 * n + 1] += static_cast<float>(s.imag());
    }
  }
}

}  // namespace sonar
