// The importer of mesh files. Its library is not ours and trusts what it reads, so it runs in a program of its own
// (docs/decisions/0023-meshes-in-a-child.md); fuzzers call it directly.
#pragma once

#include <cstdint>
#include <functional>

#include "core/scene/files/load_mesh.hpp"

namespace sonar {

struct ImportHooks {
  std::function<void(std::uintmax_t bytes)> opened = [](std::uintmax_t) {};  // the files opened by now hold so many
  std::function<void()> imported = [] {};                                    // what follows is code of ours
};

/// Errors begin with the file's name.
Result<LoadedMesh> import_mesh(const MeshFile& request, const ImportHooks& hooks = {});

}  // namespace sonar
