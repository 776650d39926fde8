// Cuts polygons of mesh files into triangles. The importer's own code is not used, because its asserts abort on unusual files.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/base/geometry.hpp"

namespace sonar {

/// Ear clipping in the polygon's own plane, for concave polygons too; keeps the polygon's direction. Fewer than 3 corners: no
/// triangles. Degenerate or self-crossing remainders, and polygons of more than 512 corners, are cut as a fan.
std::vector<std::array<std::uint32_t, 3>> triangulate(std::span<const Vec3d> corners);

}  // namespace sonar
