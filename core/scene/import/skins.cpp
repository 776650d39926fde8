#include "core/scene/import/skins.hpp"

#include <assimp/scene.h>

#include <limits>
#include <map>
#include <string>

#include "core/scene/import/node_graph.hpp"

namespace sonar {
namespace {

using Matrix = aiMatrix4x4t<double>;
using Places = std::map<std::string, Matrix>;

/// The positions of all nodes in the scene. If nodes have the same name, the first one counts.
void find_places(const aiNode& node, const Matrix& parent, unsigned depth, Places& places) {
  if (depth > NodeGraph::deepest) return;
  const Matrix here = parent * Matrix(node.mTransformation);
  places.try_emplace(node.mName.C_Str(), here);
  for (unsigned c = 0; c < node.mNumChildren; ++c) find_places(*node.mChildren[c], here, depth + 1, places);
}

std::vector<Vec3d> skin_of(const aiMesh& mesh, const Places& places) {
  std::vector<Vec3d> sums(mesh.mNumVertices);
  std::vector<double> weights(mesh.mNumVertices);
  for (unsigned b = 0; b < mesh.mNumBones; ++b) {
    const aiBone& bone = *mesh.mBones[b];
    const auto place = places.find(bone.mName.C_Str());
    if (place == places.end()) continue;
    const Matrix moved = place->second * Matrix(bone.mOffsetMatrix);
    for (unsigned w = 0; w < bone.mNumWeights; ++w) {
      const aiVertexWeight& weight = bone.mWeights[w];
      if (weight.mVertexId >= mesh.mNumVertices || !(weight.mWeight > 0)) continue;
      const aiVector3D& p = mesh.mVertices[weight.mVertexId];
      const aiVector3t<double> v = moved * aiVector3t<double>(p.x, p.y, p.z);
      const double share = static_cast<double>(weight.mWeight);
      sums[weight.mVertexId] = sums[weight.mVertexId] + share * Vec3d{v.x, v.y, v.z};
      weights[weight.mVertexId] += share;
    }
  }
  constexpr double no_place = std::numeric_limits<double>::quiet_NaN();
  for (std::size_t v = 0; v < sums.size(); ++v)
    sums[v] = weights[v] > 0 ? (1 / weights[v]) * sums[v] : Vec3d{no_place, no_place, no_place};
  return sums;
}

}  // namespace

std::vector<std::vector<Vec3d>> skins_of(const aiScene& scene) {
  std::vector<std::vector<Vec3d>> skins(scene.mNumMeshes);
  Places places;
  for (unsigned m = 0; m < scene.mNumMeshes; ++m) {
    if (scene.mMeshes[m]->mNumBones == 0) continue;
    if (places.empty()) find_places(*scene.mRootNode, Matrix(), 0, places);
    skins[m] = skin_of(*scene.mMeshes[m], places);
  }
  return skins;
}

}  // namespace sonar
