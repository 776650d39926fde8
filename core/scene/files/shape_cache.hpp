// Keeps the meshes of shapes for code that reads many similar scenes. Equal shapes share one mesh, so that values computed from
// the mesh can be reused, too. Only one thread may use the cache at a time.
#pragma once

#include <algorithm>
#include <cstddef>
#include <map>
#include <memory>
#include <string>

#include "core/scene/files/load_mesh.hpp"
#include "core/scene/scene.hpp"

namespace sonar {

struct Shape {
  std::shared_ptr<const Mesh> mesh;  // null after an error
  Vec3d centre_m;                    // origin of the mesh in the object's frame
  Primitive primitive = {};          // the exact surface of shapes that have one
};

class ShapeCache {
 public:
  // While there are too many triangles, old shapes are removed, except those of the last `always_kept` calls of shape().
  static constexpr std::size_t most_triangles = 1'000'000, always_kept = 64;

  /// Returns the shape of this key. Calls make() if the cache does not have it. A shape without a mesh is not cached.
  Shape shape(const std::string& key, const auto& make) {
    Kept& kept = shapes_[key];
    if (!kept.shape.mesh) {
      kept.shape = make();
      triangles_ += kept.shape.mesh ? kept.shape.mesh->triangles.size() : 0;
    }
    kept.last_used = ++uses_;
    const Shape shape = kept.shape;
    while (triangles_ > most_triangles && forget_oldest()) {
    }
    return shape;
  }
  /// Mesh files that were read, by path and options. They are not read again when a file changes.
  std::map<std::string, LoadedMesh>& mesh_files() { return mesh_files_; }

 private:
  struct Kept {
    Shape shape;
    std::size_t last_used = 0;
  };
  bool forget_oldest() {
    const auto oldest = std::ranges::min_element(shapes_, {}, [](const auto& entry) { return entry.second.last_used; });
    if (uses_ - oldest->second.last_used < always_kept) return false;
    triangles_ -= oldest->second.shape.mesh ? oldest->second.shape.mesh->triangles.size() : 0;
    shapes_.erase(oldest);
    return true;
  }

  std::map<std::string, Kept> shapes_;
  std::map<std::string, LoadedMesh> mesh_files_;
  std::size_t triangles_ = 0, uses_ = 0;
};

}  // namespace sonar
