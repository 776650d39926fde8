#include "core/pipeline/noise.hpp"

#include <algorithm>
#include <cmath>

#include "core/base/random.hpp"
#include "core/pipeline/arithmetic/noise_place.hpp"

namespace sonar {
namespace {

constexpr std::uint32_t table_samples = noise_table_samples;
constexpr std::uint32_t table_key = 0x6e6f6973u;  // keeps these draws apart

}  // namespace

void NoiseTable::prepare(Seed seed, const std::vector<float>& filter) {
  const auto bits = static_cast<std::uint64_t>(seed);
  const auto lo = static_cast<std::uint32_t>(bits), hi = static_cast<std::uint32_t>(bits >> 32);
  const bool same_seed = !white_.empty() && seed == seed_;
  if (same_seed && filter == filter_) return;
  if (!same_seed) {
    white_.resize(2 * table_samples);
    for (std::uint32_t i = 0; i < table_samples; i += 2) {
      const Random4 draw = philox(i, 0, 0, table_key, lo, hi);
      for (std::uint32_t half = 0; half < 2; ++half) {
        const ComplexNormal z = complex_normal(draw.v[2 * half], draw.v[2 * half + 1]);
        white_[2 * (i + half)] = z.re;
        white_[2 * (i + half) + 1] = z.im;
      }
    }
  }
  seed_ = seed;
  filter_ = filter;
  shaped_.assign(white_.size(), 0.0f);
  const std::size_t n = white_.size();
  for (std::size_t tap = 0; tap < filter.size(); ++tap) {  // circular, so that reading may wrap
    const std::size_t shift = 2 * tap;
    for (std::size_t i = 0; i < n; ++i) shaped_[i] += filter[tap] * white_[i >= shift ? i - shift : n + i - shift];
  }
}

void NoiseTable::add(std::uint32_t sonar, std::uint32_t ping, int column_index, float rms, int samples, float* column) const {
  read(sonar, ping, column_index, rms, samples, column, [](auto& to, auto noise) { to += noise; });
}

void NoiseTable::set(std::uint32_t sonar, std::uint32_t ping, int column_index, float rms, int samples, float* column) const {
  read(sonar, ping, column_index, rms, samples, column, [](auto& to, auto noise) { to = noise; });
}

template <class Put>
void NoiseTable::read(std::uint32_t sonar, std::uint32_t ping, int column_index, float rms, int samples, float* column,
                      Put put) const {
  const auto bits = static_cast<std::uint64_t>(seed_);
  const NoisePlace place = noise_place(static_cast<std::uint32_t>(bits), static_cast<std::uint32_t>(bits >> 32), sonar, ping,
                                       static_cast<std::uint32_t>(column_index));
  std::size_t at = place.first;
  const float sign = place.negative ? -rms : rms;
  for (int done = 0; done < samples;) {
    const int run = static_cast<int>(std::min<std::size_t>(static_cast<std::size_t>(samples - done), table_samples - at));
    const float* __restrict from = shaped_.data() + 2 * at;
    float* __restrict to = column + 2 * static_cast<std::ptrdiff_t>(done);
    if (place.quarter)
      for (int i = 0; i < run; ++i) {
        put(to[2 * i], -sign * from[2 * i + 1]);
        put(to[2 * i + 1], sign * from[2 * i]);
      }
    else
      for (int i = 0; i < 2 * run; ++i) put(to[i], sign * from[i]);
    done += run;
    at = 0;
  }
}

}  // namespace sonar
