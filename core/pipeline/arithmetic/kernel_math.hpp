// The formulas of the hot loops for one value at a time, and the sizes of their tables. Device code includes this file, so it
// must compile as C++17.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "core/base/host_device.hpp"

namespace sonar {

/// Terms of the even polynomial that approximates the elevation pattern, in w = sin^2(elevation angle).
inline constexpr int elevation_terms = 9;
/// Each node of the depth map names its object. The last six bits of 1 / x hold the object's number modulo 64. If a scene has
/// more than 64 objects, the last ten bits of the slope hold further bits of the number, because the slope needs little
/// precision.
inline constexpr int surface_mark_bits = 6;
inline constexpr std::int32_t surface_marks = (1 << surface_mark_bits) - 1, upper_marks = 1023;
SONAR_HD constexpr std::int32_t surface_mark(std::uint32_t object) { return static_cast<std::int32_t>(object & 0xFFFFu); }
SONAR_HD constexpr std::int32_t upper_mark(std::int32_t mark) { return mark >> surface_mark_bits; }
SONAR_HD constexpr bool has_upper_marks(std::size_t objects) { return objects > static_cast<std::size_t>(surface_marks) + 1; }
/// A cell of another object is hidden if it lies more than contact_m [m] + contact_share * range behind the hit surface.
inline constexpr float contact_m = 1e-3f, contact_share = 2e-5f;
/// The axis of the depth map. Bins are uniform in the tangent: narrow between the two edges, wide in the side lobes outside
/// them.
struct TangentAxis {
  float middle_bin, edge_tangent, bins_per_tangent, side_bins_per_tangent;
};
/// Look-ups stay at least this far below the end of the last bin, because a tangent just below the fan's edge may be rounded up
/// to the edge.
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
/// Marks a node with its object. A node of 0 means that nothing was hit, and stays 0.
SONAR_HD inline float with_mark(float inverse_x, std::int32_t mark) {
  return inverse_x > 0 ? with_last_bits(inverse_x, mark, surface_marks) : inverse_x;
}
SONAR_HD inline float with_upper_mark(float slope, std::int32_t mark) {
  return with_last_bits(slope, upper_mark(mark), upper_marks);
}

#include "core/pipeline/arithmetic/kernel_math.inl"

}  // namespace sonar
