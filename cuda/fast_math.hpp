// The short polynomials of the hot loops for one value at a time: as core/pipeline/simd/kernels.inl has them, whose copies are
// compiled for one instruction set each and must not meet these at the linker. Tests hold both equal bit by bit.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>

#include "core/base/host_device.hpp"

namespace sonar::cuda {

SONAR_HD inline float larger(float a, float b) { return a > b ? a : b; }
SONAR_HD inline float smaller(float a, float b) { return a < b ? a : b; }

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

SONAR_HD inline float sine_of_turns(float turns) {
  float x = turns - std::floor(turns + 0.5f);
  const float folded = (x > 0 ? 0.5f : -0.5f) - x;
  x = std::fabs(x) > 0.25f ? folded : x;
  const float y = 6.2831853071795865f * x, y2 = y * y;
  float p = -2.5052108e-8f;
  p = p * y2 + 2.7557319e-6f;
  p = p * y2 - 1.9841270e-4f;
  p = p * y2 + 8.3333333e-3f;
  p = p * y2 - 1.6666667e-1f;
  return y + y * y2 * p;
}

SONAR_HD inline float log2_of(float x) {  // x > 0 and normal
  const std::uint32_t bits = bits_of(x);
  const std::int32_t exponent = static_cast<std::int32_t>(bits - 0x3f3504f3u) >> 23;
  const float m = float_of(bits - (static_cast<std::uint32_t>(exponent) << 23));
  const float t = (m - 1.0f) / (m + 1.0f), t2 = t * t;
  float p = 2.0f / 11.0f;
  p = p * t2 + 2.0f / 9.0f;
  p = p * t2 + 2.0f / 7.0f;
  p = p * t2 + 2.0f / 5.0f;
  p = p * t2 + 2.0f / 3.0f;
  p = p * t2 + 2.0f;
  return static_cast<float>(exponent) + 1.44269504f * t * p;
}

SONAR_HD inline float exp2_of(float x) {
  x = x < -126.0f ? -126.0f : (x > 126.0f ? 126.0f : x);
  const float whole = std::floor(x + 0.5f);
  const float f = (x - whole) * 0.69314718f;
  float p = 1.0f / 5040.0f;
  p = p * f + 1.0f / 720.0f;
  p = p * f + 1.0f / 120.0f;
  p = p * f + 1.0f / 24.0f;
  p = p * f + 1.0f / 6.0f;
  p = p * f + 0.5f;
  p = p * f + 1.0f;
  p = p * f + 1.0f;
  return p * float_of(static_cast<std::uint32_t>(static_cast<std::int32_t>(whole) + 127) << 23);
}

}  // namespace sonar::cuda
