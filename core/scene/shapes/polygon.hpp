// Cuts polygons of mesh files into triangles. The importer's own code is not used, because its asserts end the program for
// unusual files.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/base/geometry.hpp"

namespace sonar {

/// Cuts a polygon by ear clipping in its own plane, also if it is concave. The triangles keep the direction of the polygon.
/// Polygons with fewer than 3 corners give no triangles. Degenerate or self-crossing remainders, and polygons of more than 512
/// corners, are cut as a fan.
std::vector<std::array<std::uint32_t, 3>> triangulate(std::span<const Vec3d> corners);

}  // namespace sonar
