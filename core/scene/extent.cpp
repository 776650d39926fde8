#include "core/scene/extent.hpp"

namespace sonar {

Extent extent_of(const Mesh& mesh) {
  Extent extent;
  for (const Vec3& v : mesh.vertices) extent.add(to_double(v));
  return extent;
}

}  // namespace sonar
