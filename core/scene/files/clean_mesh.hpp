// Checks and cleans the triangles of a mesh, for all file formats.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "core/base/result.hpp"
#include "core/scene/shapes/terrain.hpp"

namespace sonar {

/// A function that receives the corners and the material of one triangle.
using TriangleSink = std::function<void(std::span<const Vec3d, 3>, std::uint16_t)>;
/// A function that passes every triangle to the sink. Each call passes the same triangles in the same order.
using TriangleSource = std::function<void(const TriangleSink&)>;

/// Checks that vertices are finite and within 1e7 m, drops triangles without area, merges equal vertices, and moves the mesh's
/// middle to the origin. It calls `source` twice, to avoid a copy of the corners. Errors do not contain the file name.
Result<CentredMesh> clean_triangles(const TriangleSource& source, std::size_t most = max_mesh_triangles);
/// Like clean_triangles(), for a list of corners, three per triangle.
Result<CentredMesh> clean_mesh(const std::vector<Vec3d>& corners, const std::vector<std::uint16_t>& material,
                               std::size_t most = max_mesh_triangles);

}  // namespace sonar
