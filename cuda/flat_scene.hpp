// The scene as rays on the device see it: triangles and hierarchies of boxes in plain arrays, made once; the bodies' places, made
// for every ping. The counterpart of core/scene/embree_scene.cpp, with the same floats relative to the same origin.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/scene/scene.hpp"
#include "cuda/bvh.hpp"
#include "cuda/device_types.hpp"

namespace sonar::cuda {

/// Where the bodies are for one ping: TracerView::top and ::bodies.
struct BodyPlaces {
  std::vector<BvhNode> top;
  std::vector<PlacedBody> bodies;
};

class FlatScene {
 public:
  explicit FlatScene(const Scene& scene);

  Vec3d origin() const { return origin_; }  // world position that float coordinates are relative to
  const std::vector<BvhNode>& nodes() const { return nodes_; }
  const std::vector<FlatTriangle>& triangles() const { return triangles_; }
  std::int32_t still_root() const { return groups_.front().root; }
  bool has_still() const { return groups_.front().has_triangles; }
  /// Bodies that are not given stay where the scene put them.
  BodyPlaces place(std::span<const Pose> bodies_in_world) const;

 private:
  struct Group {  // [0] everything that stands still, [1 + b] body b
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

/// A view with pointers into host memory: for tests and host loops.
TracerView host_view(const FlatScene& scene, const BodyPlaces& places);

}  // namespace sonar::cuda
