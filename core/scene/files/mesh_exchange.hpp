// Messages between the daemon and the program that imports meshes: the request as arguments and standard input, the answer as a
// file. Both sides check the lengths that they receive.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/scene/shapes/terrain.hpp"

namespace sonar {

// A mesh file named by a scene, and its contents.

enum class UpAxis { y, z };

struct MeshFile {
  std::filesystem::path file;
  double scale = 1;              // file units to metres
  std::optional<UpAxis> up{};    // axis of the file that is up; unset: y for glTF/GLB, as the file states for DAE, else z
  std::string_view in_memory{};  // the contents of the file, if not read from disk; `file` then gives only name and format
  std::string part{};            // name of a node or mesh of the file (any name if it has only one part); empty: all parts
  std::optional<std::filesystem::path> folder{};  // folder of the scene; a mesh may name files in it, and in the mesh's folder
};

struct LoadedMesh {
  CentredMesh centred;                      // Mesh::material indexes material_names
  std::vector<std::string> material_names;  // names in the file; may be empty
  std::uint64_t lost = 0;                   // triangles of faces that the importer could not read
  std::uint64_t hidden = 0;                 // triangles of parts that are not in the file's shown scene
};

struct ImportRequest {
  MeshFile mesh;  // `in_memory` is passed as standard input
  bool on_disk = true;
  int parent = 0;                  // id of the process that waits for the answer
  std::filesystem::path readable;  // folder of confine_reads(); empty: all folders
  std::filesystem::path memory_root;
};

std::vector<std::string> arguments_of(const ImportRequest& request);
/// Reads the request; nullopt if it comes from another version of the program.
std::optional<ImportRequest> request_from(const std::vector<std::string>& arguments);

/// Writes the answer; false if it does not fit into the file. read_answer() returns only complete answers.
bool write_answer(int descriptor, const Result<LoadedMesh>& mesh);
/// Writes an error. It allocates no memory, so a signal handler may call it.
bool write_refusal(int descriptor, ErrorKind kind, std::string_view text);
/// Reads the answer; nullopt if it is incomplete.
std::optional<Result<LoadedMesh>> read_answer(int descriptor);

}  // namespace sonar
