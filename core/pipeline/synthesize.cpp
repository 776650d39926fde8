#include "core/pipeline/synthesize.hpp"

#include <algorithm>

namespace sonar {

void clear_columns(ColumnSignals& signals, int first, int last) {
  std::fill(signals.column(first), signals.column(first) + (last - first) * signals.stride, 0.0f);
}

/// Eq. 8 (docs/acoustics.md, section 4): g_k[n] += A_i p(t_n - tau_i), p from the table of rows.
void synthesize(Echoes& echoes, const simd::PulseRows& pulse, const simd::Kernels& kernels, ColumnSignals& signals) {
  kernels.accumulate(echoes.at(0), echoes.count, pulse, signals.data.data(), signals.stride, 0, signals.lead);
  echoes.count = 0;
}

namespace {

/// Where T(u) is 1 the order of noise and T(u) does not matter.
bool begins_with_noise(const PingPlan& plan, const PingNoise& noise, int column) {
  return noise.table && !plan.expected_power && plan.columns.transmit[static_cast<std::size_t>(column)] == 1.0f;
}

}  // namespace

void begin_columns(const PingPlan& plan, const PingNoise& noise, int first, int last, ColumnSignals& signals) {
  // rms of one column: the level at a beam's output over sqrt(sum_k W_jk^2) (section 5).
  const auto rms = static_cast<float>(plan.column_noise_upa);
  for (int k = first; k < last; ++k) {
    float *at = signals.column(k), *end = at + signals.stride;
    if (!begins_with_noise(plan, noise, k)) {
      std::fill(at, end, 0.0f);
      continue;
    }
    float* samples = at + 2 * signals.lead;
    std::fill(at, samples, 0.0f);
    noise.table->set(noise.sonar, noise.ping, k, rms, signals.samples, samples);
    std::fill(samples + 2 * signals.samples, end, 0.0f);
  }
}

void finish_columns(const PingPlan& plan, const PingNoise& noise, int first, int last, ColumnSignals& signals) {
  const auto rms = static_cast<float>(plan.column_noise_upa);
  for (int k = first; k < last; ++k) {
    if (begins_with_noise(plan, noise, k)) continue;
    float* at = signals.column(k);
    const float amplitude = plan.columns.transmit[static_cast<std::size_t>(k)];
    // T(u) of eq. 6: 1 over the sector, soft beyond. Noise is added after it.
    if (amplitude != 1.0f) {
      const float factor = plan.expected_power ? amplitude * amplitude : amplitude;
      for (std::ptrdiff_t i = 0; i < signals.stride; ++i) at[i] *= factor;
    }
    float* samples = at + 2 * signals.lead;
    if (!noise.table) continue;
    // Expected power: E|n|^2 = rms^2 in every sample.
    if (plan.expected_power)
      for (int n = 0; n < signals.samples; ++n) samples[2 * n] += rms * rms;
    else
      noise.table->add(noise.sonar, noise.ping, k, rms, signals.samples, samples);
  }
}

}  // namespace sonar
