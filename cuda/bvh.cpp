#include "cuda/bvh.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

namespace sonar::cuda {
namespace {

// Surface-area rule: the probability that a ray hits a box is proportional to its area. Therefore the cost of a part is its
// area times its number of triangles.
constexpr int bins = 16;
constexpr std::size_t most_in_leaf = 4;
constexpr int deepest_by_area = 32;  // below this depth, items are halved by number; this takes at most 32 more levels
constexpr float node_cost = 1.2f;    // cost of a node, in triangle tests

void grow(Box& box, const Box& by) {
  for (int k = 0; k < 3; ++k) {
    box.low[k] = std::min(box.low[k], by.low[k]);
    box.high[k] = std::max(box.high[k], by.high[k]);
  }
}
/// Half the area of a box; 0 for the empty one.
float half_area(const Box& b) {
  const float x = b.high[0] - b.low[0], y = b.high[1] - b.low[1], z = b.high[2] - b.low[2];
  return x < 0 ? 0 : x * y + y * z + z * x;
}
/// Twice the centre. Only the order and the ratios of centres are used.
float twice_centre(const Box& b, int axis) { return b.low[axis] + b.high[axis]; }

struct Split {
  int axis = -1, bin = 0;
  float cost = huge_distance;
};

class Builder {
 public:
  Builder(std::span<const Box> items, std::vector<BvhNode>& nodes, std::vector<std::uint32_t>& order)
      : items_(items), nodes_(nodes), order_(order), index_(items.size()) {
    std::iota(index_.begin(), index_.end(), 0u);
  }

  std::int32_t run() {
    const auto root = static_cast<std::int32_t>(nodes_.size());
    if (index_.size() <= most_in_leaf) {  // the root must be a node; a single leaf becomes its child
      nodes_.push_back({});
      const Box all = bounds(0, index_.size());
      set_child(root, 0, all, index_.empty() ? 0 : leaf(0, index_.size()));
      set_child(root, 1, no_box, 0);
      if (index_.empty()) set_child(root, 0, no_box, 0);
      return root;
    }
    return split(0, index_.size(), 0);
  }

 private:
  Box bounds(std::size_t from, std::size_t to) const {
    Box box = no_box;
    for (std::size_t i = from; i < to; ++i) grow(box, items_[index_[i]]);
    return box;
  }
  void set_child(std::int32_t node, int side, const Box& box, std::int32_t link) {
    BvhNode& n = nodes_[static_cast<std::size_t>(node)];
    std::copy(box.low, box.low + 3, n.low[side]);
    std::copy(box.high, box.high + 3, n.high[side]);
    n.link[side] = link;
  }
  std::int32_t leaf(std::size_t from, std::size_t to) {
    const auto first = static_cast<std::uint32_t>(order_.size());
    for (std::size_t i = from; i < to; ++i) order_.push_back(index_[i]);
    return bvh_link({first, static_cast<std::uint32_t>(to - from)});
  }

  /// Splits [from, to), which has too many items for a leaf. Returns the new node.
  std::int32_t split(std::size_t from, std::size_t to, int depth) {
    const auto node = static_cast<std::int32_t>(nodes_.size());
    nodes_.push_back({});
    // Halving by number limits the depth, and therefore the stack of a ray (bvh.hpp).
    const std::size_t middle = depth < deepest_by_area ? divide(from, to) : halve(from, to);
    const std::size_t ends[3] = {from, middle, to};
    for (int side = 0; side < 2; ++side) {
      const std::size_t a = ends[side], b = ends[side + 1];
      const Box box = bounds(a, b);
      const std::int32_t link = b - a <= most_in_leaf ? leaf(a, b) : split(a, b, depth + 1);
      set_child(node, side, box, link);
    }
    return node;
  }

  std::size_t halve(std::size_t from, std::size_t to) const { return from + (to - from) / 2; }

  /// Splits at the cheapest of the planes between bins. If all centres are equal, splits by number.
  std::size_t divide(std::size_t from, std::size_t to) {
    Box centres = no_box;
    for (std::size_t i = from; i < to; ++i)
      for (int k = 0; k < 3; ++k) {
        const float c = twice_centre(items_[index_[i]], k);
        centres.low[k] = std::min(centres.low[k], c);
        centres.high[k] = std::max(centres.high[k], c);
      }
    Split best;
    for (int axis = 0; axis < 3; ++axis) consider(from, to, centres, axis, best);
    if (best.axis < 0) return halve(from, to);
    const auto first = index_.begin() + static_cast<std::ptrdiff_t>(from),
               last = index_.begin() + static_cast<std::ptrdiff_t>(to);
    // The partition is stable, so that the order of triangles, and the choice between equal hits, is the same in every build.
    const auto middle =
        std::stable_partition(first, last, [&](std::uint32_t i) { return bin_of(items_[i], centres, best.axis) <= best.bin; });
    return static_cast<std::size_t>(middle - index_.begin());
  }
  static int bin_of(const Box& item, const Box& centres, int axis) {
    const float part = (twice_centre(item, axis) - centres.low[axis]) / (centres.high[axis] - centres.low[axis]);
    return std::clamp(static_cast<int>(part * bins), 0, bins - 1);
  }
  void consider(std::size_t from, std::size_t to, const Box& centres, int axis, Split& best) const {
    // If all centres lie in one plane, a split along its normal would divide by a length of 0.
    if (!(centres.high[axis] > centres.low[axis])) return;
    std::array<Box, bins> box;
    box.fill(no_box);
    std::array<std::size_t, bins> count{};
    for (std::size_t i = from; i < to; ++i) {
      const Box& item = items_[index_[i]];
      const auto b = static_cast<std::size_t>(bin_of(item, centres, axis));
      grow(box[b], item);
      ++count[b];
    }
    // First computes the cost of all bins above each plane, then that of all bins below it.
    std::array<float, bins> above{};
    Box all = no_box;
    std::size_t number = 0;
    for (std::size_t b = bins - 1; b > 0; --b) {
      grow(all, box[b]);
      number += count[b];
      above[b - 1] = number == 0 ? huge_distance : half_area(all) * static_cast<float>(number);
    }
    all = no_box;
    number = 0;
    for (std::size_t b = 0; b + 1 < bins; ++b) {
      grow(all, box[b]);
      number += count[b];
      // A plane without items below it does not divide them.
      if (number == 0) continue;
      const float cost = node_cost + half_area(all) * static_cast<float>(number) + above[b];
      if (cost < best.cost) best = {axis, static_cast<int>(b), cost};
    }
  }

  std::span<const Box> items_;
  std::vector<BvhNode>& nodes_;
  std::vector<std::uint32_t>& order_;
  std::vector<std::uint32_t> index_;
};

}  // namespace

std::int32_t build_bvh(std::span<const Box> items, std::vector<BvhNode>& nodes, std::vector<std::uint32_t>& order) {
  return Builder(items, nodes, order).run();
}

}  // namespace sonar::cuda
