// Finds the side of the sea surface on which a sonar is. Engines call it before they compute, so that a sonar at the
// surface gets the same ping as one just below it, and one in the air receives noise only.
#pragma once

#include <span>
#include <vector>

#include "core/scene/scene.hpp"
#include "core/sonar/ping.hpp"

namespace sonar {

/// Depth [m] that replaces the depth of a sonar nearer to the sea surface, z = 0, than this, below or above it.
inline constexpr double least_depth_m = 1e-3;

/// Whether a sonar there is above the sea surface and receives noise only; false in scenes without a sea surface.
bool is_in_air(const Pose& sonar_in_world, const Scene& scene);

/// The requests to be computed: those given if nothing has to be changed, else changed copies in `room`. In scenes with a sea
/// surface the ping of a sonar above it is blank, a sonar at it is moved just below it, and none leaves the water during its
/// ping.
std::span<const PingRequest> in_water(std::span<const PingRequest> requests, const Scene& scene, std::vector<PingRequest>& room);

/// Restores the requested poses of the sonars in the pings of such requests. PingRequest::blank stays as computed.
void restore_requested_pose(std::span<const PingRequest> requests, std::span<Ping> pings);

}  // namespace sonar
