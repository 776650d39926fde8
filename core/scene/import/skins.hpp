// Computes the rest positions of the vertices of meshes with bones.
#pragma once

#include <vector>

#include "core/base/geometry.hpp"

struct aiScene;

namespace sonar {

/// For each mesh of the scene: its vertices in the coordinates of the scene. Vertices that no bone moves are NaN. The list is
/// empty for a mesh without bones. Bones replace the transform of the node that shows the mesh.
std::vector<std::vector<Vec3d>> skins_of(const aiScene& scene);

}  // namespace sonar
