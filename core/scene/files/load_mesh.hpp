// Reads mesh files (OBJ, STL, PLY, glTF/GLB, DAE) into checked triangles, relative to the mesh's middle. The loader of
// scenes and the importer of worlds (clients/scene_tools) use it.
#pragma once

#include "core/base/result.hpp"
#include "core/scene/files/mesh_file.hpp"

namespace sonar {

/// Errors: missing, unknown format, unreadable, empty, not finite, beyond 1e7 m, more than 20 million
/// triangles, no triangle with an area, files elsewhere, too much memory or time. y up becomes z up by (x, y, z) -> (x, -z, y).
/// A separate program reads all formats but binary STL (docs/decisions/0023-meshes-in-a-child.md).
Result<LoadedMesh> load_mesh(const MeshFile& request);

}  // namespace sonar
