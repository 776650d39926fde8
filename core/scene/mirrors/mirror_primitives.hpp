// Mirror points of spheres, cylinders, boxes and planes in closed form, from outside and, for tanks, from inside.
// Feeds core/pipeline/specular with exact radii and extents where a mesh would only have facets.
#pragma once

#include <vector>

#include "core/scene/mirrors/mirror_point.hpp"
#include "core/scene/scene.hpp"

namespace sonar {

/// Appends the mirror points of the primitive that may be heard; what hides them is the caller's business. Nothing for
/// Kind::none.
void find_mirror_points(const Primitive& primitive, const MirrorQuery& query, std::vector<MirrorPoint>& out);

}  // namespace sonar
