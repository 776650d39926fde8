// Imports mesh files with Assimp. That library does not check all of its input, so the import runs in a separate program
// (docs/decisions/0023-meshes-in-a-child.md). Fuzzers call import_mesh() directly.
#pragma once

#include <cstdint>
#include <functional>

#include "core/scene/files/load_mesh.hpp"

namespace sonar {

struct ImportHooks {
  std::function<void(std::uintmax_t bytes)> opened = [](std::uintmax_t) {};  // bytes of all files opened so far
  std::function<void()> imported = [] {};                                    // called when the library has finished
};

/// Imports a mesh file. Errors begin with the file's name.
Result<LoadedMesh> import_mesh(const MeshFile& request, const ImportHooks& hooks = {});

}  // namespace sonar
