// Writes a mesh as binary glTF 2.0 (https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html, 4.4).
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/base/geometry.hpp"
#include "protocol/wire/wire.hpp"

namespace sonar::foxglove {

/// Writes one mesh with one material. In glTF y is up, here z is up, so (x, y, z) is written as (x, z, -y), which viewers
/// reverse. The normal of a vertex is the mean over its triangles, weighted by area. `colour`: red, green, blue from 0 to 1.
wire::Bytes glb(std::span<const Vec3> vertices, std::span<const std::array<std::uint32_t, 3>> triangles,
                const std::array<double, 3>& colour);

}  // namespace sonar::foxglove
