// The flat faces of a scene that are large enough to be mirrors for sound: sides of boxes and tanks, planes, the still sea
// surface. They are found once for each scene. The pipeline selects the mirrors among them, which depend on frequency and
// material.
#pragma once

#include <cstdint>
#include <vector>

#include "core/scene/scene.hpp"

namespace sonar {

/// Coplanar triangles of one object and one material. Their points have dot(normal, p) = offset_m, object coordinates.
struct FlatFace {
  int object = 0, material = 0;
  Vec3d normal;  // unit, either side
  double offset_m = 0;
  double area_m2 = 0;
};

struct FlatFaces {
  std::vector<FlatFace> faces;  // largest first
  /// [object][triangle]: index into `faces`, or -1. Empty for an object without such faces.
  std::vector<std::vector<std::int32_t>> of_triangle;

  int face_of(std::uint32_t object, std::uint32_t triangle) const {
    const auto& of = of_triangle[object];
    return of.empty() ? -1 : of[triangle];
  }
};

/// Finds faces of at least 0.05 m^2 that are not narrow strips. Facets of a round wall, whose neighbours meet at small angles,
/// are excluded. Materials that reflect less than `least_reflection` are ignored.
FlatFaces find_flat_faces(const Scene& scene, double least_reflection);

}  // namespace sonar
