#include "clients/bvtsdk/core/sample_grid.hpp"

#include <algorithm>
#include <cmath>

namespace sonar::bvt {
namespace {

constexpr float full_scale = 65535;

using Samples = std::vector<std::uint16_t>;

Samples pooled_bins(const std::uint16_t* samples, std::size_t beams, std::size_t bins, std::size_t pool) {
  const std::size_t whole = bins / pool, out_bins = (bins + pool - 1) / pool;
  Samples out(beams * out_bins);
  for (std::size_t j = 0; j < beams; ++j) {
    const std::uint16_t* const in = samples + j * bins;
    std::uint16_t* const to = out.data() + j * out_bins;
    if (pool == 2)  // the usual case, written so that it is vectorised
      for (std::size_t k = 0; k < whole; ++k) to[k] = std::max(in[2 * k], in[2 * k + 1]);
    else
      for (std::size_t k = 0; k < whole; ++k) to[k] = *std::max_element(in + k * pool, in + (k + 1) * pool);
    if (whole < out_bins) to[whole] = *std::max_element(in + whole * pool, in + bins);
  }
  return out;
}

}  // namespace

double range_scale(const PolarPing& ping, int sound_speed_override_mps) {
  return sound_speed_override_mps > 0 ? static_cast<double>(sound_speed_override_mps) / ping.sound_speed_mps : 1.0;
}

std::uint16_t lowest_significant(float noise_threshold) {
  if (!(noise_threshold > 0)) return 0;
  return static_cast<std::uint16_t>(std::ceil(std::min(noise_threshold, 1.0f) * full_scale));
}

SampleGrid::SampleGrid(const PolarPing& ping, float noise_threshold, float clipping_threshold, int pool) {
  auto beams = static_cast<std::size_t>(ping.beams), bins = static_cast<std::size_t>(ping.bins);
  const std::uint16_t* samples = ping.samples.data();
  // Samples are pooled before the thresholds apply. The result is the same, and the thresholds apply to fewer samples.
  const std::size_t together = std::min(bins, static_cast<std::size_t>(std::max(pool, 1)));
  if (together > 1) {
    made_ = pooled_bins(samples, beams, bins, together);
    bins = made_.size() / beams;
    samples = made_.data();
    pooled_ = static_cast<double>(together);
  }
  const std::uint16_t lowest = lowest_significant(noise_threshold);
  const bool clips = clipping_threshold > 0 && clipping_threshold < 1;
  const auto highest = static_cast<std::uint16_t>(clips ? std::lround(clipping_threshold * full_scale) : 65535);
  if (lowest > 0 || clips) {
    made_.resize(beams * bins);
    std::transform(samples, samples + beams * bins, made_.begin(),
                   [=](std::uint16_t v) { return std::min(v < lowest ? std::uint16_t{0} : v, highest); });
    samples = made_.data();
  }
  if (bins == 1) {  // each sample twice, each half as long
    Samples twice(2 * beams);
    for (std::size_t j = 0; j < beams; ++j) twice[2 * j] = twice[2 * j + 1] = samples[j];
    made_ = std::move(twice);
    samples = made_.data();
    bins = 2;
    pooled_ *= 0.5;
  }
  if (beams == 1) {  // the beam twice, each half as wide
    Samples twice(samples, samples + bins);
    twice.insert(twice.end(), samples, samples + bins);
    made_ = std::move(twice);
    samples = made_.data();
    beams = 2;
  }
  view_ = {samples, static_cast<int>(beams), static_cast<int>(bins)};
}

}  // namespace sonar::bvt
