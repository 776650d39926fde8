// The formulas of the hot loops for one value at a time, and the sizes of their tables. Device code reads it: C++17-clean.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>

#include "core/base/host_device.hpp"

namespace sonar {

/// Terms of the even polynomial that stands for the elevation pattern, in w = sin^2(elevation angle).
inline constexpr int elevation_terms = 9;
/// Intervals of a tabulated scattering law; the table has law_steps + 2 values.
inline constexpr int law_steps = 128;

SONAR_HD inline std::uint32_t bits_of(float x) {
  std::uint32_t bits;
  std::memcpy(&bits, &x, sizeof bits);
  return bits;
}
SONAR_HD inline float float_of(std::uint32_t bits) {
  float x;
  std::memcpy(&x, &bits, sizeof x);
  return x;
}

#include "core/pipeline/arithmetic/kernel_math.inl"

}  // namespace sonar
