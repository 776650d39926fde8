// A mesh file named by a scene, and its contents.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
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
  std::string_view in_memory{};  // the contents of the file, if not read from disk; `file` then gives only name and format
  std::optional<std::filesystem::path> folder{};  // folder of the scene; a mesh may refer to files in it, and in its own folder
};

struct LoadedMesh {
  CentredMesh centred;                      // Mesh::material indexes material_names
  std::vector<std::string> material_names;  // names in the file; may be empty
  std::uint64_t lost = 0;                   // triangles of faces that the importer could not read
  std::uint64_t hidden = 0;                 // triangles of parts that are not in the file's shown scene
};

}  // namespace sonar
