// Traces rays through a scene with a bounding-volume hierarchy (Embree, used only by embree_scene.cpp and embree_trees.hpp).
// Static geometry is built once, relative to `origin()`. Moving bodies are instances that are placed for each ping. A program
// can replace the tracer at link time by defining the members of RayScene. Tests that trace analytic primitives under the
// thread sanitizer do so (tests/core/pipeline/analytic_rays.cpp).
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "core/base/geometry.hpp"
#include "core/scene/scene.hpp"

namespace sonar {

/// Sixteen rays, as a structure of arrays. Set origin, direction and far; after trace(), `far` is the distance of the first
/// hit.
struct alignas(64) RayPacket {
  static constexpr int size = 16;
  static constexpr std::uint32_t miss = 0xFFFFFFFFu;
  float origin_x[size], origin_y[size], origin_z[size];           // [m], relative to RayScene::origin()
  float direction_x[size], direction_y[size], direction_z[size];  // unit length, world axes
  float far[size];                                       // in: longest distance of interest [m]; out: distance of the hit
  std::uint32_t object[size];                            // out: index into Scene::objects, or miss
  std::uint32_t triangle[size];                          // out: index into that object's mesh
  float normal_x[size], normal_y[size], normal_z[size];  // out: geometric normal, world axes, not normalised, either side
};

class RayScene {
 public:
  /// `build_threads` is the largest number of threads that Embree uses for building.
  RayScene(std::shared_ptr<const Scene> scene, int build_threads);
  ~RayScene();
  RayScene(const RayScene&) = delete;
  RayScene& operator=(const RayScene&) = delete;

  /// Replaces the scene. Static objects with the same mesh at the same position keep their trees, even if scenes alternate. The
  /// hits equal those of a new RayScene.
  void change(std::shared_ptr<const Scene> scene);
  const Scene& scene() const;
  Vec3d origin() const;  // world position to which float coordinates are relative
  /// Moves the bodies. Call it on the thread that owns the scene, before tracing. It takes no time if no body has moved.
  void place(std::span<const Pose> bodies_in_world);
  /// Finds the first hits of the active lanes (bit i of `active`). Inactive lanes may have any values; their `object` becomes
  /// `miss`. An active ray without a hit keeps `far` and gets the normal 0. Several threads may call it between two calls of
  /// place().
  void trace(RayPacket& rays, std::uint32_t active, bool coherent) const;
  /// Number of rays that are traced together on this processor: 16 with AVX-512, 8 with AVX, otherwise 4.
  int rays_at_once() const;
  static std::string version();  // "Embree 3.13.5"

  /// From this number of triangles on, the static part and each body are stored in a compact form: indices instead of copies of
  /// the corners. This saves about 65 bytes per triangle. The hits are the same.
  static constexpr std::size_t compact_from_triangles = 2'000'000;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// True if a surface lies between two points of the world. A surface at the far point does not count.
bool is_occluded(const RayScene& scene, Vec3d from, Vec3d place);

}  // namespace sonar
