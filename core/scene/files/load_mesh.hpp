// Reads mesh files (OBJ, STL, PLY, glTF/GLB, DAE) into checked triangles about their own middle. Used by the scene loader only.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/scene/shapes/terrain.hpp"

namespace sonar {

enum class UpAxis { y, z };

struct MeshFile {
  std::filesystem::path file;
  double scale = 1;              // file units to metres
  std::optional<UpAxis> up{};    // axis of the file that is up; unset: y for glTF/GLB, its own tag for DAE, z otherwise
  std::string_view in_memory{};  // the contents, when `file` only names them and says the format
  std::optional<std::filesystem::path> folder{};  // folder of the scene; a mesh may refer to files in it, and in its own folder
};

struct LoadedMesh {
  CentredMesh centred;                      // Mesh::material indexes material_names
  std::vector<std::string> material_names;  // as the file calls them; may be empty strings
  std::uint64_t lost = 0;                   // triangles of faces that the file lists and the importer does not read
  std::uint64_t hidden = 0;                 // triangles of parts that the scene in the file does not show
};

/// Refused with one sentence: missing, unknown format, unreadable, empty, not finite, beyond 1e7 m, more than 20 million
/// triangles, no triangle with an area, files elsewhere, too much memory or time. y up becomes z up by (x, y, z) -> (x, -z, y).
/// All but binary STL is read by a program of its own (docs/decisions/0023-meshes-in-a-child.md).
Result<LoadedMesh> load_mesh(const MeshFile& request);

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
