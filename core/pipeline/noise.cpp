#include "core/pipeline/noise.hpp"

#include <algorithm>
#include <cmath>

#include "core/base/random.hpp"
#include "core/pipeline/arithmetic/noise_place.hpp"

namespace sonar {
namespace {

constexpr std::uint32_t table_samples = noise_table_samples;

/// White complex Gaussians, E|z|^2 = 1. A draw of four words makes two of them.
std::vector<float> white_noise(Seed seed) {
  std::vector<float> white(2 * table_samples);
  const RandomKey key = key_of(seed, Domain::noise_table);
  for (std::uint32_t i = 0; i < table_samples; i += 2) {
    const Random4 draw = philox(i, 0, 0, key);
    for (std::uint32_t half = 0; half < 2; ++half) {
      const ComplexNormal z = complex_normal(draw.v[2 * half], draw.v[2 * half + 1]);
      white[2 * (i + half)] = z.re;
      white[2 * (i + half) + 1] = z.im;
    }
  }
  return white;
}

void add_scaled(float by, const float* __restrict from, std::size_t count, float* __restrict to) {
  for (std::size_t i = 0; i < count; ++i) to[i] += by * from[i];
}

/// n[i] = sum_m h[m] w[i - m], with h of unit energy (make_noise_filter), so the variance stays 1. The filter is circular, so
/// that reading may wrap around.
std::vector<float> filtered(const std::vector<float>& white, const std::vector<float>& filter) {
  const std::size_t n = white.size();
  std::vector<float> shaped(n, 0.0f);
  for (std::size_t tap = 0; tap < filter.size(); ++tap) {
    const std::size_t shift = 2 * tap;
    add_scaled(filter[tap], white.data() + n - shift, shift, shaped.data());
    add_scaled(filter[tap], white.data(), n - shift, shaped.data() + shift);
  }
  return shaped;
}

}  // namespace

void NoiseTable::prepare(Seed seed, const std::vector<float>& filter, std::span<const NoiseTable* const> others) {
  // The table is kept until seed or filter change.
  const bool same_seed = white_ && seed == seed_;
  if (same_seed && filter == filter_) return;
  if (!same_seed) white_.reset();
  seed_ = seed;
  filter_ = filter;
  for (const NoiseTable* other : others) {
    if (other == this || !other->white_ || other->seed_ != seed) continue;
    white_ = other->white_;
    if (other->filter_ != filter) continue;
    shaped_ = other->shaped_;
    return;
  }
  if (!white_) white_ = std::make_shared<const std::vector<float>>(white_noise(seed));
  shaped_ = std::make_shared<const std::vector<float>>(filtered(*white_, filter));
}

std::size_t NoiseTable::bytes(std::set<const void*>& counted) const {
  std::size_t bytes = 0;
  for (const auto& draws : {white_, shaped_})
    if (draws && counted.insert(draws.get()).second) bytes += sizeof(float) * draws->capacity();
  return bytes;
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
  const NoisePlace place = noise_place(key_of(seed_, Domain::noise_place), sonar, ping, static_cast<std::uint32_t>(column_index));
  std::size_t at = place.first;
  // Reads the table from a hashed start, rotated by one of four quarter turns. Both are a function of (seed, sonar, ping,
  // column).
  const float sign = place.negative ? -rms : rms;
  // The table is periodic. After its end, reading continues at its beginning.
  for (int done = 0; done < samples;) {
    const int run = static_cast<int>(std::min<std::size_t>(static_cast<std::size_t>(samples - done), table_samples - at));
    const float* __restrict from = shaped_->data() + 2 * at;
    float* __restrict to = column + 2 * static_cast<std::ptrdiff_t>(done);
    // Multiplication by i: (re, im) -> (-im, re).
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
