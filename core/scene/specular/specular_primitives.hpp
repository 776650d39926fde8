// Computes mirror points of spheres, cylinders, boxes and planes in closed form, from outside and, for tanks, from inside.
// core/pipeline/specular thus has exact radii and extents, where a mesh has only facets.
#pragma once

#include <vector>

#include "core/scene/scene.hpp"
#include "core/scene/specular/specular_point.hpp"

namespace sonar {

/// Appends the mirror points of the primitive that may be audible; the caller tests occlusion. Nothing for
/// Kind::none.
void find_specular_points(const Primitive& primitive, const SpecularQuery& query, std::vector<SpecularPoint>& out);

}  // namespace sonar
