// Reads mesh files (OBJ, STL, PLY, glTF/GLB, DAE) into checked triangles, relative to the mesh's middle. The loader of
// scenes and the importer of worlds (clients/scene_tools) use it.
#pragma once

#include <cstdint>
#include <cstdio>
#include <optional>

#include "core/base/result.hpp"
#include "core/scene/files/mesh_exchange.hpp"
#include "core/scene/files/mesh_steps.hpp"

namespace sonar {

/// Reads a mesh file. Errors: the file is missing, unreadable, empty or of an unknown format; vertices are not finite or beyond
/// 1e7 m; there are more than 20 million triangles, or none with an area; the file names files in other folders; it needs too
/// much memory or time. y up is converted to z up: (x, y, z) -> (x, -z, y). A separate program reads all formats but binary STL
/// (docs/decisions/0023-meshes-in-a-child.md).
Result<LoadedMesh> load_mesh(const MeshFile& request);

// Reads binary STL files, a few triangles at a time. The importer of other formats would need three times the file's size in
// memory.

inline constexpr std::size_t bytes_of_stl_triangle = 50;

struct BinaryStl {
  std::uint64_t triangles = 0;     // number in the file's header
  std::uint64_t bytes_behind = 0;  // bytes after the last triangle
};

/// Returns nullopt if the file is not a binary STL file: it is too short for the number of triangles in its header. This is
/// true of every text.
std::optional<BinaryStl> binary_stl(std::FILE* file);
/// Passes `count` triangles of the file to `take`, with material 0. Returns false if a triangle could not be read.
bool each_triangle_of_binary_stl(std::FILE* file, std::uint64_t count, const TriangleSink& take);

}  // namespace sonar
