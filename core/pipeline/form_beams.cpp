#include "core/pipeline/form_beams.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <utility>

namespace sonar {

void form_beams(const ColumnSignals& columns, const BeamWeights& beam_weights, const simd::Kernels& kernels, BeamScratch& scratch,
                BeamSignals& out) {
  const ColumnRange all{0, columns.columns};
  form_beams(columns, beam_weights, {}, {&all, 1}, kernels, scratch, out);
}

void form_beams(const ColumnSignals& columns, const BeamWeights& beam_weights, BeamChoice wanted,
                std::span<const ColumnRange> used, const simd::Kernels& kernels, BeamScratch& scratch, BeamSignals& out) {
  // A window of complex samples of all columns: two floats per sample.
  const int floats = static_cast<int>(out.stride), first_sample = out.first_sample;
  // Eq. 9 for all beams at once, as a convolution over columns that are uniform in u = sin(azimuth) (simd/kernels.hpp).
  if (beam_weights.transform) {
    scratch.transform.resize(beam_weights.transform->work_floats());
    kernels.transform_beams(beam_weights.transform->tables(), columns.first_sample(0) + 2 * first_sample, columns.stride, floats,
                            scratch.transform.data(), out.data.data(), floats);
    return;
  }
  // Copies the samples to adjacent memory, because the records of columns are too far apart to stay in the cache together.
  scratch.window.resize(static_cast<std::size_t>(floats) * static_cast<std::size_t>(columns.columns));
  const auto place_of = [&](int k) { return scratch.window.begin() + static_cast<std::ptrdiff_t>(k) * floats; };
  int done = 0;
  for (const ColumnRange& range : used) {
    // Panels read the other columns with weights of 0. These columns may contain any values.
    std::fill(place_of(done), place_of(range.first), 0.0f);
    for (int k = range.first; k < range.last; ++k) {
      const float* from = columns.first_sample(k) + 2 * first_sample;
      std::copy(from, from + floats, place_of(k));
    }
    done = range.last;
  }
  std::fill(place_of(done), place_of(columns.columns), 0.0f);
  // Eq. 9 as a banded product: each panel makes four beams from the columns within half_band of them.
  for (const BeamPanel& panel : beam_weights.panels) {
    if (!wanted.is_all() && wanted.next(panel.first_beam) >= panel.first_beam + 4) continue;
    kernels.form_beam_panel(scratch.window.data() + static_cast<std::ptrdiff_t>(panel.first_column) * floats, floats,
                            beam_weights.weights.data() + panel.weights, panel.count, out.beam(panel.first_beam), floats);
  }
}

SampledPulse place_pulse(const PointEcho& point, const PingPlan& plan, int from, int to) {
  const int middle = static_cast<int>(std::floor(point.sample));
  SampledPulse pulse;
  // Only samples within half of the pulse's taps from the echo are not 0.
  pulse.first_sample = std::max(middle - plan.taps / 2 + 1, from);
  const int end = std::min(middle + plan.taps / 2 + 1, to);
  // Eq. 8 for one echo, in double, at its exact delay, without a table.
  for (int n = pulse.first_sample; n < end; ++n)
    pulse.values.push_back(point.amplitude * plan.pulse_shape.at(plan.sample_time_s * (n - point.sample)));
  return pulse;
}

void add_points(std::span<const PointEcho> points, const PingPlan& plan, BeamSignals& out) {
  struct Placed {
    double sine;
    SampledPulse pulse;
  };
  std::vector<Placed> here;
  for (const PointEcho& point : points) {
    SampledPulse pulse = place_pulse(point, plan, out.first_sample, out.first_sample + out.samples);
    if (!pulse.values.empty()) here.push_back({point.sine, std::move(pulse)});
  }
  if (here.empty()) return;

  // The weight of a point is the pattern at its exact direction, W(u - u_j), not the weight of its nearest column.
  std::vector<std::complex<double>> sum;
  // The points are added beam by beam in their order. Windows on different threads share no sum.
  for (int j = 0; j < out.beams; ++j) {
    sum.assign(static_cast<std::size_t>(out.samples), 0.0);
    for (const auto& [sine, pulse] : here) {
      const auto beam = static_cast<std::size_t>(j);
      const double weight = plan.beam_pattern[beam](sine - plan.beam_sine[beam]);
      const auto first = static_cast<std::size_t>(pulse.first_sample - out.first_sample);
      for (std::size_t i = 0; i < pulse.values.size(); ++i) sum[first + i] += weight * pulse.values[i];
    }
    float* beam = out.beam(j);
    for (int n = 0; n < out.samples; ++n) {
      // In expected power, points also add coherently with each other. The power of their sum is added.
      const std::complex<double> s = sum[static_cast<std::size_t>(n)];
      beam[2 * n] += static_cast<float>(plan.expected_power ? std::norm(s) : s.real());
      if (!plan.expected_power) beam[2 * n + 1] += static_cast<float>(s.imag());
    }
  }
}

}  // namespace sonar
