// The formulas of the hot loops for one value at a time, and the sizes of their tables. Device code reads it: C++17-clean.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "core/base/host_device.hpp"

namespace sonar {

/// Terms of the even polynomial that stands for the elevation pattern, in w = sin^2(elevation angle).
inline constexpr int elevation_terms = 9;
/// Which object a place of the depth map is of: the last bits of 1 / x hold its number modulo 64; in a scene of more objects
/// those of the slope, whose precision matters little, hold ten bits more.
inline constexpr int surface_mark_bits = 6;
inline constexpr std::int32_t surface_marks = (1 << surface_mark_bits) - 1, upper_marks = 1023;
SONAR_HD constexpr std::int32_t surface_mark(std::uint32_t object) { return static_cast<std::int32_t>(object & 0xFFFFu); }
SONAR_HD constexpr std::int32_t upper_mark(std::int32_t mark) { return mark >> surface_mark_bits; }
SONAR_HD constexpr bool has_upper_marks(std::size_t objects) { return objects > static_cast<std::size_t>(surface_marks) + 1; }
/// A cell of another object is hidden from so much behind the surface that was hit [m], and this share of its range.
inline constexpr float contact_m = 1e-3f, contact_share = 2e-5f;
/// The depth map's axis: bins even in the tangent, narrow up to an edge on either side and wide in the side lobes beyond.
struct TangentAxis {
  float middle_bin, edge_tangent, bins_per_tangent, side_bins_per_tangent;
};
/// Bins are looked up so far below the last at most: a tangent just below the fan's edge may be rounded onto it.
inline constexpr float bin_rounding = 1.0f / 1024;
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

SONAR_HD inline float tangent_of_bin(const TangentAxis& a, float bin) {
  const float from_middle = bin - a.middle_bin, edge = a.edge_tangent * a.bins_per_tangent;
  const float held = from_middle < -edge ? -edge : (from_middle > edge ? edge : from_middle);
  return held / a.bins_per_tangent + (from_middle - held) / a.side_bins_per_tangent;
}

SONAR_HD inline float with_last_bits(float x, std::int32_t bits, std::int32_t among) {
  return float_of((bits_of(x) & ~static_cast<std::uint32_t>(among)) | static_cast<std::uint32_t>(bits & among));
}
/// 0, nothing, stays as it is.
SONAR_HD inline float with_mark(float inverse_x, std::int32_t mark) {
  return inverse_x > 0 ? with_last_bits(inverse_x, mark, surface_marks) : inverse_x;
}
SONAR_HD inline float with_upper_mark(float slope, std::int32_t mark) {
  return with_last_bits(slope, upper_mark(mark), upper_marks);
}

#include "core/pipeline/arithmetic/kernel_math.inl"

}  // namespace sonar
