#include "core/pipeline/ping_scalars.hpp"

#include <cmath>

#include "core/pipeline/arithmetic/scattering.hpp"

namespace sonar {

PingScalars make_scalars(const PingPlan& plan, const PingRequest& request, Vec3d scene_origin) {
  PingScalars s;
  const double depth = depth_from_z(request.sonar_in_world.position_m.z);
  const double hz = static_cast<double>(plan.mode.centre_hz);
  s.sound_speed_mps = true_sound_speed_mps(request.water, depth);
  s.absorption_np_per_m = nepers_from_db(absorption_db_per_m(request.water, depth, hz));
  s.source_upa = amplitude_from_db(static_cast<double>(plan.mode.source_level_db));
  // The device turns time into range with the sound speed it believes in.
  s.samples_per_m = static_cast<double>(plan.settings.device_sound_speed_mps) / s.sound_speed_mps / plan.sample_spacing_m;
  s.sample_offset = plan.sample_offset;
  s.max_range_m = (plan.samples + plan.sample_offset + plan.taps) / s.samples_per_m;
  s.turns_per_m = 2 * hz / s.sound_speed_mps;
  s.world_from_sonar = rotation_from(request.sonar_in_world.orientation);
  s.position_in_scene = to_float(request.sonar_in_world.position_m - scene_origin);
  return s;
}

}  // namespace sonar
