// The graph of the nodes of a mesh file. Its size shows whether the scene would become too large, before an importer reads the
// file.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/base/geometry.hpp"

struct aiScene;

namespace sonar {

class NodeGraph {
 public:
  static constexpr std::uint32_t deepest = 200;
  /// Limit of repetitions: a file that names a node several times shows it several times.
  static constexpr std::uint64_t most_repeated = 200'000;

  std::size_t add(std::string name) {
    nodes_.push_back({std::move(name), {}});
    return nodes_.size() - 1;
  }
  void contains(std::size_t parent, std::size_t child) { nodes_[parent].children.push_back(child); }

  /// Returns the fault of the graph as a text that follows the file's name: a node contains itself, nodes are nested too deep,
  /// or they are repeated too often below the roots. nullopt if there is no fault. The time is linear in the number of edges.
  std::optional<std::string> fault(const std::vector<std::size_t>& roots) const;

  /// Returns the roots and the nodes below them, each as often as it is shown. The graph must have no fault.
  std::vector<std::size_t> shown(std::vector<std::size_t> roots) const;

 private:
  struct Node {
    std::string name;
    std::vector<std::size_t> children;
  };
  std::vector<Node> nodes_;
};

// Computes the rest positions of the vertices of meshes with bones.

/// For each mesh of the scene: its vertices in the coordinates of the scene. Vertices that no bone moves are NaN. The list is
/// empty for a mesh without bones. Bones replace the transform of the node that shows the mesh.
std::vector<std::vector<Vec3d>> skins_of(const aiScene& scene);

}  // namespace sonar
