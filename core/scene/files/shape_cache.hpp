// Meshes of shapes that were made before, for readers of many similar scenes. Equal shapes share one mesh, so that everything
// that is computed from meshes can be kept too. Used by one thread at a time.
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
  Vec3d centre_m;                    // the mesh's own zero in the object's frame
  Primitive primitive = {};          // the true surface, of shapes that have one
};

class ShapeCache {
 public:
  // Shapes of the last `always_kept` calls of shape() are never removed; older ones are, while there are too many triangles.
  static constexpr std::size_t most_triangles = 1'000'000, always_kept = 64;

  /// Returns the shape of that key; calls make() if the cache does not have it. A shape without a mesh is made again each time.
  template <class Make>
  Shape shape(const std::string& key, const Make& make) {
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
  /// Mesh files that were read, by path and options. They stay as they were read.
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
