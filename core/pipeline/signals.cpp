#include "core/pipeline/signals.hpp"

#include <algorithm>

namespace sonar {

void Echoes::reserve(int capacity) {
  // One more vector is allocated, because kernels store whole vectors.
  const auto n = static_cast<std::size_t>(capacity) + 16;
  sample.resize(n);
  re.resize(n);
  im.resize(n);
  column.resize(n);
  if (keeps_power) power.resize(n);
}

void Echoes::add(float at_sample, std::complex<float> amplitude, int in_column) {
  if (count == capacity()) reserve(std::max(1024, 2 * count));
  const auto i = static_cast<std::size_t>(count++);
  sample[i] = at_sample;
  re[i] = amplitude.real();
  im[i] = amplitude.imag();
  column[i] = in_column;
}

void ColumnSignals::shape(int column_count, int sample_count, int taps) {
  columns = column_count;
  samples = sample_count;
  lead = taps;
  // Additional memory for late pulses, and for tiles that read whole vectors past the last sample.
  stride = 2 * (lead + samples + taps + 64);
  stride = (stride + 15) / 16 * 16;
  if (stride % 1024 == 0) stride += 16;  // columns that share cache sets would evict each other
  data.resize(static_cast<std::size_t>(stride * column_count));
}

void BeamSignals::shape(int beam_count, int first, int count) {
  beams = beam_count;
  first_sample = first;
  samples = count;
  stride = (2 * count + 31) / 32 * 32;
  data.resize(static_cast<std::size_t>(stride) *
              static_cast<std::size_t>((beam_count + 3) / 4 * 4));  // kernels write four at a time
}

}  // namespace sonar
