// Computes mirror points of spheres, cylinders, boxes and planes in closed form, from outside and, for tanks, from inside. So
// core/pipeline/specular gets exact radii and extents instead of those of facets.
#pragma once

#include <vector>

#include "core/scene/scene.hpp"
#include "core/scene/specular/specular_point.hpp"

namespace sonar {

/// Appends the mirror points of the primitive whose echoes may be strong enough. The caller tests whether they are hidden.
/// Kind::none has no mirror points.
void find_specular_points(const Primitive& primitive, const SpecularQuery& query, std::vector<SpecularPoint>& out);

}  // namespace sonar
