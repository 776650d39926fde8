// The steps that the daemon's own readers of meshes and the importer share; one of them checks and cleans the triangles.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string_view>
#include <vector>

#include "core/base/result.hpp"
#include "core/scene/files/mesh_exchange.hpp"
#include "core/scene/shapes/terrain.hpp"

namespace sonar {

constexpr std::uintmax_t max_mesh_bytes = std::uintmax_t{2} << 30;  // limit for a file and the files to which it refers, together

/// The extension in small letters, such as ".obj".
std::string mesh_extension(const std::filesystem::path& file);
/// True if files with this extension are read as meshes.
bool is_mesh_extension(std::string_view extension);
/// True if y is up in imported meshes of this format, unless MeshFile::up states another axis. For COLLADA, Assimp always makes
/// y up.
inline bool is_y_up_by_default(std::string_view extension) {
  return extension == ".gltf" || extension == ".glb" || extension == ".dae";
}

tl::unexpected<Error> bad_mesh(const MeshFile& request, const std::string& what);

/// Returns an error if the import of files of `bytes` bytes would need more memory than is free.
Result<void> check_import_memory(const MeshFile& request, std::uintmax_t bytes);

/// A function that receives the corners and the material of one triangle.
using TriangleSink = std::function<void(std::span<const Vec3d, 3>, std::uint16_t)>;
/// A function that passes every triangle to the sink. Each call passes the same triangles in the same order.
using TriangleSource = std::function<void(const TriangleSink&)>;

/// Converts and cleans the triangles. `source` must pass at most `triangles` triangles, in the file's units and axes.
Result<LoadedMesh> finish_mesh(const MeshFile& request, bool y_up_by_default, std::uint64_t triangles,
                               std::vector<std::string> names, const TriangleSource& source);

/// Checks that vertices are finite and within 1e7 m, drops triangles without area, merges equal vertices, and moves the mesh's
/// middle to the origin. It calls `source` twice, to avoid a copy of the corners. Errors do not contain the file name.
Result<CentredMesh> clean_triangles(const TriangleSource& source, std::size_t most = max_mesh_triangles);
/// Like clean_triangles(), for a list of corners, three per triangle.
Result<CentredMesh> clean_mesh(const std::vector<Vec3d>& corners, const std::vector<std::uint16_t>& material,
                               std::size_t most = max_mesh_triangles);

}  // namespace sonar
