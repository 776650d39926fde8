// The steps that the daemon's own readers of meshes and the importer share.
#pragma once

#include <string_view>

#include "core/scene/files/clean_mesh.hpp"
#include "core/scene/files/mesh_exchange.hpp"

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

/// `source` must pass at most `triangles` triangles, in the file's units and axes.
Result<LoadedMesh> finish_mesh(const MeshFile& request, bool y_up_by_default, std::uint64_t triangles,
                               std::vector<std::string> names, const TriangleSource& source);

}  // namespace sonar
