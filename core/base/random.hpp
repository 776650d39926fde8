// Counter-based random numbers: every draw is a function of its key and counter. Therefore a draw does not depend on the order
// of draws, on threads or on the device. Source: Salmon et al. 2011, "Parallel random numbers: as easy as 1, 2, 3"
// (Philox4x32-10). Tests compare with the known-answer vectors of Random123.
#pragma once

#include <cmath>
#include <cstdint>

#include "core/base/host_device.hpp"

namespace sonar {

enum class Seed : std::uint64_t;  // defined in core/base/units.hpp, which device code cannot include

struct Random4 {
  std::uint32_t v[4];
};
struct ComplexNormal {
  float re, im;
};

/// Philox4x32 with ten rounds: four 32-bit words from a 128-bit counter and a 64-bit key.
SONAR_HD constexpr Random4 philox(std::uint32_t c0, std::uint32_t c1, std::uint32_t c2, std::uint32_t c3, std::uint32_t k0,
                                  std::uint32_t k1) {
  for (int round = 0; round < 10; ++round) {
    const std::uint64_t p0 = std::uint64_t{0xD2511F53u} * c0;
    const std::uint64_t p1 = std::uint64_t{0xCD9E8D57u} * c2;
    const std::uint32_t n0 = static_cast<std::uint32_t>(p1 >> 32) ^ c1 ^ k0;
    const std::uint32_t n2 = static_cast<std::uint32_t>(p0 >> 32) ^ c3 ^ k1;
    c1 = static_cast<std::uint32_t>(p1);
    c3 = static_cast<std::uint32_t>(p0);
    c0 = n0;
    c2 = n2;
    k0 += 0x9E3779B9u;
    k1 += 0xBB67AE85u;
  }
  return {{c0, c1, c2, c3}};
}

/// The independent streams of random numbers. A value is the last word of the counter unless its comment states otherwise;
/// "combined with" means exclusive or.
enum class Domain : std::uint32_t {
  cells = 0,                // speckle and positions of surface cells; the counter's last word is the level
  cell_blocks = 0x6e6574u,  // positions within blocks of cells; combined with the key's low word
  texture = 0x74657874u,    // combined with the index of the object
  grain = 0x67726169u,      // combined with the index of the object
  noise_table = 0x6e6f6973u,
  noise_place = 0x706c6163u,
  leak = 0x6c65616bu,           // used with noise_place; combined with the sonar's number
  fixed_fan = 0x66616eu,        // speckle of a hit of the fixed fan
  paper_speckle = 0x50323521u,  // speckle of a hit in the modes paper and raster
  // Phase and carrier offset of another sonar; with the words of the key swapped, phase and carrier offset of one pulse.
  other_sonar = 0x6f746872u,
  range_speckle = 0x72736b6cu,    // speckle of a ray in range images, by the hit point of the ray
  range_noise = 0x726e6f69u,      // noise of a pixel in range images
  relief_value = 0x76616c75u,     // seabed and rocks; used as the key's high word, combined with the stream
  relief_gradient = 0x67726164u,  // seabed and rocks; used as the key's high word, not combined
};

/// The key of one stream of draws.
struct RandomKey {
  std::uint32_t low = 0, high = 0, domain = 0;
};
SONAR_HD constexpr RandomKey key_of(Seed seed, Domain domain) {
  const auto bits = static_cast<std::uint64_t>(seed);
  return {static_cast<std::uint32_t>(bits), static_cast<std::uint32_t>(bits >> 32), static_cast<std::uint32_t>(domain)};
}
SONAR_HD constexpr Random4 philox(std::uint32_t c0, std::uint32_t c1, std::uint32_t c2, const RandomKey& key) {
  return philox(c0, c1, c2, key.domain, key.low, key.high);
}

/// Returns a number in (0, 1): never 0, so that its logarithm is finite.
SONAR_HD constexpr float uniform_open(std::uint32_t bits) { return (static_cast<float>(bits >> 9) + 0.5f) * (1.0f / 8388608.0f); }

/// Returns a circular complex Gaussian number with E|z|^2 = 1 (Box-Muller).
SONAR_HD inline ComplexNormal complex_normal(std::uint32_t a, std::uint32_t b) {
  const float radius = std::sqrt(-std::log(uniform_open(a)));
  const float angle = 6.28318530717958647692f * uniform_open(b);
  return {radius * std::cos(angle), radius * std::sin(angle)};
}

}  // namespace sonar
