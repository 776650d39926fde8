// Determines on which side of the sea surface a sonar is. Engines call in_water() before they compute a ping. Then a sonar at the
// surface gets the same ping as one just below it, and a sonar in the air receives only noise.
#pragma once

#include <span>
#include <vector>

#include "core/scene/scene.hpp"
#include "core/sonar/ping.hpp"

namespace sonar {

/// Least depth of a sonar below the sea surface, z = 0 [m]. A sonar that is nearer to the surface, on either side, is moved to
/// this depth.
inline constexpr double least_depth_m = 1e-3;

/// True if a sonar at this position is above the sea surface and receives only noise. False in scenes without a sea surface.
bool is_in_air(const Pose& sonar_in_world, const Scene& scene);

/// Returns the requests to be computed: the given ones if they need no change, else changed copies in `changed`. In scenes with
/// a sea surface the ping of a sonar above it is blank, a sonar at it is moved just below it, and a rising sonar is still below
/// it at PingScalars::seen_at_s.
std::span<const PingRequest> in_water(std::span<const PingRequest> requests, const Scene& scene,
                                      std::vector<PingRequest>& changed);

/// Restores the requested poses of the sonars in the pings of changed requests. PingRequest::blank stays as computed.
void restore_requested_pose(std::span<const PingRequest> requests, std::span<Ping> pings);

}  // namespace sonar
