// Messages between the daemon and the program that imports meshes: the request as arguments and standard input, the answer as a
// file. Neither side trusts the lengths that the other sends.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/scene/files/mesh_file.hpp"

namespace sonar {

struct ImportRequest {
  MeshFile mesh;  // `in_memory` is passed as standard input
  bool on_disk = true;
  int parent = 0;                  // id of the process that waits for the answer
  std::filesystem::path readable;  // folder of confine_reads(); empty: all
  std::filesystem::path memory_root;
};

std::vector<std::string> arguments_of(const ImportRequest& request);
/// Reads the request; nullopt if it comes from another version of the program.
std::optional<ImportRequest> request_from(const std::vector<std::string>& arguments);

/// False if the answer does not fit into the file. read_answer() returns only complete answers.
bool write_answer(int descriptor, const Result<LoadedMesh>& mesh);
/// Writes an error. It allocates no memory, so a signal handler may call it.
bool write_refusal(int descriptor, ErrorKind kind, std::string_view text);
/// Reads the answer; nullopt if it is incomplete.
std::optional<Result<LoadedMesh>> read_answer(int descriptor);

}  // namespace sonar
