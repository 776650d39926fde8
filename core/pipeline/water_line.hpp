// Finds the side of the sea surface on which a sonar is. Engines call it before they compute, so that a sonar that floats sees
// what one just below the surface sees, and one in the air receives noise only.
#pragma once

#include <span>
#include <vector>

#include "core/scene/scene.hpp"
#include "core/sonar/ping.hpp"

namespace sonar {

/// Depth [m] at which a sonar is computed when it is nearer to the sea surface, z = 0, or up to as much above it.
inline constexpr double least_depth_m = 1e-3;

/// Whether a sonar there is above the sea surface and receives noise only; false in scenes without one.
bool is_in_air(const Pose& sonar_in_world, const Scene& scene);

/// The requests as they are to be computed; those given where nothing is to be changed, else copies in `room`. In scenes with a
/// sea surface: the ping of a sonar above it is blank, one at it is put just below, and none leaves the water during its ping.
std::span<const PingRequest> in_water(std::span<const PingRequest> requests, const Scene& scene, std::vector<PingRequest>& room);

/// Puts the true poses of the sonars back into the pings of such requests; PingRequest::blank is left as it was computed.
void restore_requested_pose(std::span<const PingRequest> requests, std::span<Ping> pings);

}  // namespace sonar
