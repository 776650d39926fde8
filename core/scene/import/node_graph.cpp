#include "core/scene/import/node_graph.hpp"

#include <algorithm>
#include <limits>
#include <map>

#include <assimp/scene.h>

namespace sonar {
namespace {

/// The subtree of a node, including the node itself.
struct Below {
  std::uint64_t nodes = 0;  // 0: not known yet
  std::uint32_t depth = 0;
  bool open = false;
};
struct Step {
  std::size_t node, next = 0;
};

}  // namespace

std::optional<std::string> NodeGraph::fault(const std::vector<std::size_t>& roots) const {
  const std::uint64_t most = nodes_.size() + most_repeated;
  std::vector<Below> below(nodes_.size());
  std::vector<Step> way;
  for (std::size_t start = 0; start < nodes_.size(); ++start) {
    if (below[start].nodes == 0) way.push_back({start}), below[start].open = true;
    while (!way.empty()) {
      const Node& node = nodes_[way.back().node];
      if (way.back().next < node.children.size()) {
        const std::size_t child = node.children[way.back().next++];
        if (below[child].open)
          return "node \"" + nodes_[child].name.substr(0, 64) + "\" contains itself; remove the reference that closes the loop";
        if (below[child].nodes == 0) way.push_back({child}), below[child].open = true;
        continue;
      }
      Below here{.nodes = 1, .depth = 1, .open = false};
      for (const std::size_t child : node.children) {
        here.nodes = std::min(here.nodes + below[child].nodes, most + 1);
        here.depth = std::max(here.depth, below[child].depth + 1);
      }
      if (here.depth > deepest)
        return "has nodes deeper than " + std::to_string(deepest) + " levels; flatten the hierarchy, then export it again";
      below[way.back().node] = here;
      way.pop_back();
    }
  }
  std::uint64_t total = 0;
  for (const std::size_t root : roots) total = std::min(total + below[root].nodes, most + 1);
  if (total > most)
    return "repeats its nodes more than " + std::to_string(most_repeated) + " times; export it without instances of instances";
  return std::nullopt;
}

std::vector<std::size_t> NodeGraph::shown(std::vector<std::size_t> roots) const {
  std::vector<std::size_t> nodes = std::move(roots);
  for (std::size_t k = 0; k < nodes.size(); ++k)  // the loop appends to `nodes`
    nodes.insert(nodes.end(), nodes_[nodes[k]].children.begin(), nodes_[nodes[k]].children.end());
  return nodes;
}

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
