// Finds files of poses whose angles were written in radians although their columns are degrees.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/base/geometry.hpp"

namespace sonar {

/// Returns why the headings of these poses, in the order of time, are probably radians that were read as degrees: "follow the
/// course ..."; nullopt if they are plausible. nullopt also if the vehicle neither moves on a curved path nor turns by a whole
/// turn.
std::optional<std::string> radians_read_as_degrees(const std::vector<Pose>& poses);

}  // namespace sonar
