// Cheap checks of mesh files before an importer reads them: numbers that the file cannot hold, and nodes that contain themselves,
// are nested too deep or multiply. Each takes a time linear in the text, and the memory of its nodes. They refuse what would take
// much time or memory; the importer finds the other faults.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace sonar {

/// The fault of a file, as a sentence that lacks the file's name; none: nothing was found.
using MeshFault = std::optional<std::string>;

/// Triangles by the text of a file that names its parts.
struct ListedFaces {
  std::uint64_t shown = 0;   // in the file's scene, each as often as the scene shows it
  std::uint64_t hidden = 0;  // triangles of parts that the scene does not refer to
};

/// `head`: the header at least, of a file of `file_bytes`.
MeshFault check_ply(std::string_view head, std::uint64_t file_bytes);
/// Text or binary (GLB), version 1 or 2.
MeshFault check_gltf(std::string_view file, ListedFaces* faces = nullptr);
MeshFault check_collada(std::string_view file, ListedFaces* faces = nullptr);
/// The fault in the container of a GLB file, version 2. The importer calls every such fault an unknown format.
MeshFault glb_fault(std::string_view file);

/// How many faces the header of a PLY file promises, and how many facets a text STL file begins.
std::uint64_t faces_of_ply(std::string_view head);
std::uint64_t facets_of_stl(std::string_view file);

constexpr std::size_t ply_head_bytes = 64 << 10;

}  // namespace sonar
