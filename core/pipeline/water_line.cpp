#include "core/pipeline/water_line.hpp"

#include <algorithm>

namespace sonar {
namespace {

/// The height [m] by which the sonar rises until PingScalars::seen_at_s, the time at which the scene is computed.
double rise_m(const PingRequest& r) {
  // Vertical speed times range / c, which is half of the ping's duration.
  return std::max(0.0, r.sonar_moves.velocity_mps.z) * r.settings.range_m /
         static_cast<double>(r.settings.device_sound_speed_mps);
}

/// True if the sonar is more than least_depth_m above z = 0.
bool is_above(const Pose& sonar_in_world) { return sonar_in_world.position_m.z > least_depth_m; }
bool is_to_change(const PingRequest& r) {
  return is_above(r.sonar_in_world) ? !r.blank : r.sonar_in_world.position_m.z + rise_m(r) > -least_depth_m;
}

void change(PingRequest& r) {
  if (is_above(r.sonar_in_world)) {
    r.blank = true;
    return;
  }
  double& z = r.sonar_in_world.position_m.z;
  double& climbs_mps = r.sonar_moves.velocity_mps.z;
  // Moves a sonar at the surface to 1 mm below it (docs/acoustics.md, section 3).
  z = std::min(z, -least_depth_m);
  // Reduces the speed of a rising sonar, so that it is just below the surface at seen_at_s. Other sonars keep their speed.
  if (const double rise = rise_m(r); rise > 0) climbs_mps *= std::clamp((-least_depth_m - z) / rise, 0.0, 1.0);
}

}  // namespace

bool is_in_air(const Pose& sonar_in_world, const Scene& scene) { return scene.sea_surface.present && is_above(sonar_in_world); }

std::span<const PingRequest> in_water(std::span<const PingRequest> requests, const Scene& scene,
                                      std::vector<PingRequest>& changed) {
  if (!scene.sea_surface.present || std::none_of(requests.begin(), requests.end(), is_to_change)) return requests;
  // Requests are copied only if one changes, which is rare.
  changed.assign(requests.begin(), requests.end());
  for (PingRequest& r : changed)
    if (is_to_change(r)) change(r);
  return changed;
}

void restore_requested_pose(std::span<const PingRequest> requests, std::span<Ping> pings) {
  // The ping states the requested pose, not the pose with which it was computed.
  for (std::size_t i = 0; i < pings.size(); ++i) {
    pings[i].request.sonar_in_world = requests[i].sonar_in_world;
    pings[i].request.sonar_moves = requests[i].sonar_moves;
  }
}

}  // namespace sonar
