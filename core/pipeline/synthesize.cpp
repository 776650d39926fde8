#include "core/pipeline/synthesize.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

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

/// True if the column's T(u) is 1. Then noise can be added before T(u) is applied.
bool begins_with_noise(const PingPlan& plan, const PingNoise& noise, int column) {
  return noise.table && !plan.expected_power && plan.columns.transmit[static_cast<std::size_t>(column)] == 1.0f;
}

}  // namespace

namespace {

/// Multiplies the noise of column `k` by the root of its profile (eq. 46).
void level_noise(const NoiseProfile& profile, int k, int count, float* noise) {
  if (profile.is_even()) return;
  const float far = profile.far[static_cast<std::size_t>(k)], more = profile.near_less_far[static_cast<std::size_t>(k)];
  const int near = std::min(count, static_cast<int>(profile.decay.size()));
  for (int n = 0; n < near; ++n) {
    const float root = std::sqrt(far + more * profile.decay[static_cast<std::size_t>(n)]);
    noise[2 * n] *= root;
    noise[2 * n + 1] *= root;
  }
  const float root = std::sqrt(far);
  for (int i = 2 * near; i < 2 * count; ++i) noise[i] *= root;
}

}  // namespace

void begin_columns(const PingPlan& plan, const PingNoise& noise, int first, int last, ColumnSignals& signals) {
  // rms of one column: the level at a beam's output divided by sqrt(sum_k W_jk^2) (docs/acoustics.md, section 5).
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
    level_noise(plan.noise_profile, k, signals.samples, samples);
    std::fill(samples + 2 * signals.samples, end, 0.0f);
  }
}

void finish_columns(const PingPlan& plan, const PingNoise& noise, int first, int last, ColumnSignals& signals) {
  std::vector<float> levelled;
  const auto rms = static_cast<float>(plan.column_noise_upa);
  for (int k = first; k < last; ++k) {
    if (begins_with_noise(plan, noise, k)) continue;
    float* at = signals.column(k);
    const float amplitude = plan.columns.transmit[static_cast<std::size_t>(k)];
    // T(u) of eq. 6 is 1 in the sector and falls beyond it. Noise is added after this factor.
    if (amplitude != 1.0f) {
      const float factor = plan.expected_power ? amplitude * amplitude : amplitude;
      for (std::ptrdiff_t i = 0; i < signals.stride; ++i) at[i] *= factor;
    }
    float* samples = at + 2 * signals.lead;
    if (!noise.table) continue;
    if (!plan.expected_power && plan.noise_profile.is_even()) {
      noise.table->add(noise.sonar, noise.ping, k, rms, signals.samples, samples);
      continue;
    }
    levelled.assign(2 * static_cast<std::size_t>(signals.samples), rms);
    if (!plan.expected_power) noise.table->set(noise.sonar, noise.ping, k, rms, signals.samples, levelled.data());
    level_noise(plan.noise_profile, k, signals.samples, levelled.data());
    // In expected power, E|n|^2 is the square of the level in every sample.
    for (int n = 0; n < 2 * signals.samples; ++n)
      samples[n] += !plan.expected_power ? levelled[static_cast<std::size_t>(n)]
                    : n % 2 == 0         ? levelled[static_cast<std::size_t>(n)] * levelled[static_cast<std::size_t>(n)]
                                         : 0.0f;
  }
}

}  // namespace sonar
