// Common parts of the fuzz targets of meshes: coordinates from a script of bytes, and conditions of every cleaned mesh.
#pragma once

#include <cmath>

#include "core/scene/files/load_mesh.hpp"
#include "tests/fuzz/heights.hpp"

namespace sonar::fuzz {

/// Returns mostly coordinates of a small lattice, so that equal corners and flat triangles are common; some are far away or not
/// numbers.
inline double coordinate(Script& script) {
  const std::uint8_t kind = script.byte();
  if (kind < 200) return 0.125 * (kind % 16) - 1;
  if (kind < 230) return static_cast<double>(script.real());
  if (kind < 240) return 1e7 * (kind - 235);
  static constexpr double odd[]{HUGE_VAL, -HUGE_VAL, NAN, 1e300, -0.0, 1e-300, 1e7, -1e7};
  return odd[kind % 8];
}

inline void check(const CentredMesh& made, std::size_t triangles) {
  require(is_finite(made.centre_m));
  require(made.mesh.triangles.size() + made.left_out == triangles);
  for (const Vec3& v : made.mesh.vertices) require(length(to_double(v)) <= 2e7);
  check(made.mesh);
}

}  // namespace sonar::fuzz
