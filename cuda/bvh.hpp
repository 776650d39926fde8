// Builds the hierarchy of boxes that rays descend on the device: binary, both children's boxes in one node of 64 bytes, split by
// the surface-area rule. On the CPU, once per scene; the small one over moving bodies once per ping.
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
/// Holds no point; its union with a box is that box.
inline constexpr Box no_box{{huge_distance, huge_distance, huge_distance}, {-huge_distance, -huge_distance, -huge_distance}};

/// Appends the nodes to `nodes`, and to `order` the items, leaf after leaf: a leaf's first item is a place in `order`. Returns
/// the root's index; there is always one, also over nothing. Deterministic. Cost: about 1 us an item.
std::int32_t build_bvh(std::span<const Box> items, std::vector<BvhNode>& nodes, std::vector<std::uint32_t>& order);

/// A walk down the hierarchy needs room for so many links: builders keep below it.
inline constexpr int deepest_bvh = 64;

}  // namespace sonar::cuda
