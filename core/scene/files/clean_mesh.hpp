// Checks and cleans the triangles of a mesh, whatever file they come from.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "core/base/result.hpp"
#include "core/scene/shapes/terrain.hpp"

namespace sonar {

/// Takes the corners of a triangle and its material.
using TriangleSink = std::function<void(std::span<const Vec3d, 3>, std::uint16_t)>;
/// Gives every triangle to the sink, each time it is called the same ones in the same order.
using TriangleSource = std::function<void(const TriangleSink&)>;

/// Shared checks of all meshes: finite, within 1e7 m; drops triangles without area and merges equal vertices, recentres. Asks for
/// the triangles twice, so that no copy of their corners is held. Errors lack the file name.
Result<CentredMesh> clean_triangles(const TriangleSource& source, std::size_t most = max_mesh_triangles);
/// As above, for a list of corners, three for each triangle.
Result<CentredMesh> clean_mesh(const std::vector<Vec3d>& corners, const std::vector<std::uint16_t>& material,
                               std::size_t most = max_mesh_triangles);

}  // namespace sonar
