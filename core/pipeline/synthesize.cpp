#include "core/pipeline/synthesize.hpp"

#include <algorithm>

namespace sonar {

void ColumnSignals::shape(int column_count, int sample_count, int taps) {
  columns = column_count;
  samples = sample_count;
  lead = taps;
  // Room for late pulses, and for tiles that read whole vectors past the last sample.
  stride = 2 * (lead + samples + taps + 64);
  stride = (stride + 15) / 16 * 16;
  if (stride % 1024 == 0) stride += 16;  // columns that share cache sets would evict each other
  data.resize(static_cast<std::size_t>(stride * column_count));
}

void clear_columns(ColumnSignals& signals, int first, int last) {
  std::fill(signals.column(first), signals.column(first) + (last - first) * signals.stride, 0.0f);
}

void synthesize(Echoes& echoes, const simd::PulseRows& pulse, const simd::Kernels& kernels, ColumnSignals& signals) {
  kernels.accumulate(echoes.at(0), echoes.count, pulse, signals.data.data(), signals.stride, 0, signals.lead);
  echoes.count = 0;
}

namespace {

bool begins_with_noise(const PingPlan& plan, const ReceiverNoise& noise, int column) {
  return noise.table && !plan.expected_power && plan.columns.transmit[static_cast<std::size_t>(column)] == 1.0f;
}

}  // namespace

void begin_columns(const PingPlan& plan, const ReceiverNoise& noise, int first, int last, ColumnSignals& signals) {
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

void finish_columns(const PingPlan& plan, const ReceiverNoise& noise, int first, int last, ColumnSignals& signals) {
  const auto rms = static_cast<float>(plan.column_noise_upa);
  for (int k = first; k < last; ++k) {
    if (begins_with_noise(plan, noise, k)) continue;
    float* at = signals.column(k);
    const float amplitude = plan.columns.transmit[static_cast<std::size_t>(k)];
    if (amplitude != 1.0f) {
      const float factor = plan.expected_power ? amplitude * amplitude : amplitude;
      for (std::ptrdiff_t i = 0; i < signals.stride; ++i) at[i] *= factor;
    }
    float* samples = at + 2 * signals.lead;
    if (!noise.table) continue;
    if (plan.expected_power)
      for (int n = 0; n < signals.samples; ++n) samples[2 * n] += rms * rms;
    else
      noise.table->add(noise.sonar, noise.ping, k, rms, signals.samples, samples);
  }
}

}  // namespace sonar
