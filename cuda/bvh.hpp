// Builds the hierarchy of boxes that rays on the device search: a binary tree, split by the surface-area rule. A node of 64
// bytes contains the boxes of both children. The CPU builds the tree once per scene, and a small tree over moving bodies once
// per ping.
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "cuda/device_types.hpp"

namespace sonar::cuda {

struct Box {
  float low[3], high[3];
};
inline constexpr float huge_distance = std::numeric_limits<float>::infinity();
/// A box that contains no point; its union with another box is the other box.
inline constexpr Box no_box{{huge_distance, huge_distance, huge_distance}, {-huge_distance, -huge_distance, -huge_distance}};

/// Appends the nodes to `nodes`, and the items, leaf after leaf, to `order`. BvhLeaf's first item is an index into `order`.
/// Returns the index of the root, which exists even without items. The result is deterministic. Cost: about 1 us per item.
std::int32_t build_bvh(std::span<const Box> items, std::vector<BvhNode>& nodes, std::vector<std::uint32_t>& order);

/// Largest depth of a hierarchy. A descending ray stores at most this many links.
inline constexpr int deepest_bvh = 64;

}  // namespace sonar::cuda
