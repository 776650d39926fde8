// Polygons of mesh files cut into triangles. Ours rather than the importer's, whose asserts end the program on odd files.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/base/geometry.hpp"

namespace sonar {

/// Ear clipping in the polygon's own plane, concave ones included; keeps the turn of the polygon. Fewer than 3 corners: nothing.
/// Degenerate or self-crossing rests, and polygons of more than 512 corners, are cut as a fan.
std::vector<std::array<std::uint32_t, 3>> triangulate(std::span<const Vec3d> corners);

}  // namespace sonar
