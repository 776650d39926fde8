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

void finish_columns(const PingPlan& plan, const NoiseTable* noise, std::uint32_t sonar, std::uint32_t ping, int first, int last,
                    ColumnSignals& signals) {
  for (int k = first; k < last; ++k) {
    float* at = signals.column(k);
    const float amplitude = plan.columns.transmit[static_cast<std::size_t>(k)];
    if (amplitude != 1.0f) {
      const float factor = plan.expected_power ? amplitude * amplitude : amplitude;
      for (std::ptrdiff_t i = 0; i < signals.stride; ++i) at[i] *= factor;
    }
    float* samples = at + 2 * signals.lead;
    const auto rms = static_cast<float>(plan.column_noise_upa);
    if (!noise) continue;
    if (plan.expected_power)
      for (int n = 0; n < signals.samples; ++n) samples[2 * n] += rms * rms;
    else
      noise->add(sonar, ping, k, rms, signals.samples, samples);
  }
}

}  // namespace sonar
