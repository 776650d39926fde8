// The ping of a sonar that reports ranges (core/sonar/range_image.hpp). Rays are traced through the cell of each beam. For each
// range cell, the power within a beam's pattern is summed. The beam reports the strongest or the nearest detected cell.
#pragma once

#include "core/base/parallel.hpp"
#include "core/scene/ray_scene.hpp"
#include "core/sonar/range_image.hpp"

namespace sonar {

/// Computes the ping. `wanted` must belong to the request; RayScene::place() must have been called. The bytes do not depend on
/// the number of threads. The function does not simulate motion while the sound travels, mirrors (specular echoes, multipath),
/// texture, volume reverberation, or other sonars.
Ping make_range_image(const RayScene& scene, const PingRequest& request, const RangeImageSettings& wanted, Parallel& pool);

}  // namespace sonar
