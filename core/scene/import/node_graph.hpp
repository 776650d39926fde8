// The nodes of a mesh file and which of them contain which, to find out how large they would become before an importer reads
// them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace sonar {

class NodeGraph {
 public:
  static constexpr std::uint32_t deepest = 200;
  /// Beyond the nodes that the file lists: those that it repeats by naming a node several times.
  static constexpr std::uint64_t most_repeated = 200'000;

  std::size_t add(std::string name) {
    nodes_.push_back({std::move(name), {}});
    return nodes_.size() - 1;
  }
  void contains(std::size_t parent, std::size_t child) { nodes_[parent].children.push_back(child); }

  /// The fault of the graph, as a sentence that lacks the file's name: nodes within themselves, too deep, or too many of them
  /// below the roots together. nullopt if there is no fault. Linear in its edges.
  std::optional<std::string> fault(const std::vector<std::size_t>& roots) const;

  /// The nodes below the roots and these themselves, each as often as it is shown. Of a graph without a fault.
  std::vector<std::size_t> shown(std::vector<std::size_t> roots) const;

 private:
  struct Node {
    std::string name;
    std::vector<std::size_t> children;
  };
  std::vector<Node> nodes_;
};

}  // namespace sonar
