// Fast checks before the importer reads a mesh file. They reject files that would need much time or memory: counts that exceed
// the file's size, and nodes that contain themselves, are nested too deep or are repeated too often. The checks need time
// linear in the size of the text, and memory for the nodes. The importer finds all other faults.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace sonar {

// The header of a PLY file: the format, and the counts and properties of its elements.

constexpr std::size_t ply_head_bytes = 64 << 10;  // limit of a header

struct PlyProperty {
  bool is_list = false;
  std::uint64_t bytes = 0;       // size in a binary file; for a list: the size of its count
  std::uint64_t item_bytes = 0;  // of a list: the size of an item
};
struct PlyElement {
  std::string name;
  std::uint64_t count = 0;  // counts that do not fit become the largest number
  std::vector<PlyProperty> properties;
};
struct PlyHead {
  std::size_t bytes = 0;  // size with its last line end; 0: the header is incomplete, and the other members are empty
  bool is_text = false, is_big_endian = false;
  std::vector<PlyElement> elements;

  /// Number of faces that the header counts.
  std::uint64_t faces() const;
};

/// Reads the header at the beginning of `file`, within its first ply_head_bytes. Words may be in capitals.
PlyHead ply_head_of(std::string_view file);

/// The fault of a file, as a sentence without the file's name; nullopt: no fault was found.
using MeshFault = std::optional<std::string>;

/// Numbers of triangles that the text of a file with named parts contains.
struct ListedFaces {
  std::uint64_t shown = 0;    // triangles in the file's scene, counted as often as they are shown
  std::uint64_t hidden = 0;   // triangles of parts that the scene does not refer to
  bool needs_floats = false;  // for glTF, version 2: gltf_with_floats() must write positions, weights or matrices of skins
};

/// Checks the counts of a header against the size of its file.
MeshFault check_ply(const PlyHead& head, std::uint64_t file_bytes);
/// Checks a file in text or binary (GLB), version 1 or 2. `is_itself` returns true if the URI of a buffer names the file.
MeshFault check_gltf(std::string_view file, ListedFaces* faces = nullptr,
                     const std::function<bool(const std::string& uri)>& is_itself = {});
MeshFault check_collada(std::string_view file, ListedFaces* faces = nullptr);
/// The JSON of a glTF file, text or GLB. It is empty or cut short if the file is.
std::string_view json_of_gltf(std::string_view file);
/// The binary chunk of a GLB file of version 2, up to the end of the file; empty if there is none.
std::string_view binary_part_of_glb(std::string_view file);
/// Finds the fault in the container of a GLB file, version 2. The importer reports every such fault as an unknown format.
MeshFault glb_fault(std::string_view file);
/// Describes the fault of a glTF or GLB file for which the importer finds no reader.
std::string unknown_gltf(std::string_view file);

/// Find incomplete records in a complete file. The importer would omit or misread such records. Binary STL files are not
/// checked here.
MeshFault check_ply_records(std::string_view file);
MeshFault check_stl_text(std::string_view file);
MeshFault check_obj(std::string_view file);

/// Counts the facets in a text STL file.
std::uint64_t facets_of_stl(std::string_view file);

}  // namespace sonar
