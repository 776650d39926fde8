#include "core/scene/import/node_graph.hpp"

#include <algorithm>

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

}  // namespace sonar
