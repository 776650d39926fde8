// The scene for rays on the device: triangles and hierarchies of boxes in plain arrays, which are made once, and the poses of
// the bodies, which are set for every ping. core/scene/embree_scene.cpp does the same for the CPU. Both use the same floats
// relative to the same origin.
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "core/scene/scene.hpp"
#include "cuda/device_types.hpp"

namespace sonar::cuda {

// Builds the hierarchy of boxes that rays on the device search: a binary tree, split by the surface-area rule. A node of 64
// bytes contains the boxes of both children. The CPU builds the tree once per scene, and a small tree over moving bodies once
// per ping.

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

/// The poses of the bodies in one ping: TracerView::top and ::bodies.
struct BodyPlaces {
  std::vector<BvhNode> top;
  std::vector<PlacedBody> bodies;
};

class FlatScene {
 public:
  explicit FlatScene(const Scene& scene);

  Vec3d origin() const { return origin_; }  // world position to which float coordinates are relative
  const std::vector<BvhNode>& nodes() const { return nodes_; }
  const std::vector<FlatTriangle>& triangles() const { return triangles_; }
  std::int32_t still_root() const { return groups_.front().root; }
  bool has_still() const { return groups_.front().has_triangles; }
  /// Bodies without a pose here keep the pose of the scene file.
  BodyPlaces place(std::span<const Pose> bodies_in_world) const;

 private:
  struct Group {  // [0] all fixed objects, [1 + b] body b
    std::int32_t root = 0;
    bool has_triangles = false;
    Box bounds{};
  };
  Vec3d origin_;
  std::vector<Pose> bodies_;
  std::vector<Group> groups_;
  std::vector<BvhNode> nodes_;
  std::vector<FlatTriangle> triangles_;
};

/// Makes a view with pointers into host memory, for tests and host loops.
TracerView host_view(const FlatScene& scene, const BodyPlaces& places);

}  // namespace sonar::cuda
