// The scene for rays on the device: triangles and hierarchies of boxes in plain arrays, which are made once, and the poses of
// the bodies, which are set for every ping. core/scene/embree_scene.cpp does the same for the CPU. Both use the same floats
// relative to the same origin.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/scene/scene.hpp"
#include "cuda/bvh.hpp"
#include "cuda/device_types.hpp"

namespace sonar::cuda {

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

/// A view with pointers into host memory, for tests and host loops.
TracerView host_view(const FlatScene& scene, const BodyPlaces& places);

}  // namespace sonar::cuda
