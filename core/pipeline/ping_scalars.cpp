#include "core/pipeline/ping_scalars.hpp"

#include <algorithm>
#include <cmath>

#include "core/pipeline/arithmetic/scattering.hpp"

namespace sonar {

Pose propagate(const Pose& pose, const Twist& twist, double seconds) {
  return {pose.position_m + seconds * twist.velocity_mps,
          normalized(pose.orientation * turned_by(seconds * twist.angular_rate_radps))};
}

EchoGeometry PingScalars::echo_geometry(Vec3d from_sonar_m) const {
  if (!moves) return {from_sonar_m, {}, {}};
  // Eq. 29: the echo is scattered at r / c and received at 2 r / c after firing. seen_at_s is the time of `seen_from`.
  const double one_way_s = length(from_sonar_m) / sound_speed_mps;
  const Vec3d moved = (one_way_s - seen_at_s) * rotate(conjugate(seen_from.orientation), twist.velocity_mps);
  const Rotation turn = rotation_from(conjugate(turned_by((2 * one_way_s - seen_at_s) * twist.angular_rate_radps)));
  return {turn * (from_sonar_m - moved), moved, turn};
}

int PingScalars::columns_turned(const PingPlan& plan) const {
  if (!moves) return 0;
  // Echoes are received at 2 r / c. The time from `seen_from` to the last echo equals the time from firing to `seen_from`; the
  // scattering takes place within half of it. u changes at most as fast as the angle. At ranges below 1 m few surfaces can be
  // hidden.
  constexpr double nearest_m = 1, most = 64;
  const double late_s = std::max(seen_at_s, 2 * max_range_m / sound_speed_mps - seen_at_s);
  const double sine = late_s * (length(twist.angular_rate_radps) + length(twist.velocity_mps) / nearest_m);
  return static_cast<int>(std::min(std::ceil(sine / plan.columns.spacing), most));
}

double PingScalars::doppler_samples(Vec3d from_sonar_m) const {
  if (doppler_m_per_mps == 0) return 0;
  // The component of the velocity towards the point shifts the pulse by (f / B) T v (docs/acoustics.md, eq. 27).
  const Vec3d velocity = rotate(conjugate(seen_from.orientation), twist.velocity_mps);
  return doppler_m_per_mps * dot(velocity, from_sonar_m) / length(from_sonar_m) * samples_per_m;
}

namespace {

/// If a target approaches at v, the frequency of a sweep's echo is higher by df = 2 v f / c. The peak of a rising sweep's echo is
/// earlier by df T / B, which is a range shorter by (f / B) T v.
double doppler_metres_per_mps(const PingPlan& plan) {
  const Waveform& w = plan.mode.waveform;
  if (w.shape != Waveform::Shape::lfm) return 0;  // the Doppler effect only changes the phase of other pulses
  const double shift =
      static_cast<double>(plan.mode.centre_hz) / sweep_bandwidth_hz(plan.pulse_shape.width_s()) * static_cast<double>(w.sweep_s);
  return w.falling ? shift : -shift;
}

}  // namespace

PingScalars make_scalars(const PingPlan& plan, const PingRequest& request, Vec3d scene_origin) {
  PingScalars s;
  const double depth = depth_from_z(request.sonar_in_world.position_m.z);
  const double hz = static_cast<double>(plan.mode.centre_hz);
  s.sound_speed_mps = true_sound_speed_mps(request.water, depth);
  s.absorption_np_per_m = nepers_from_db(absorption_db_per_m(request.water, depth, hz));
  s.source_upa = amplitude_from_db(static_cast<double>(plan.mode.source_level_db));
  // The device converts time to range with the sound speed of its settings.
  s.samples_per_m = static_cast<double>(plan.settings.device_sound_speed_mps) / s.sound_speed_mps / plan.sample_spacing_m;
  s.sample_offset = plan.sample_offset;
  s.max_range_m = (plan.samples + plan.sample_offset + plan.taps) / s.samples_per_m;
  s.turns_per_m = 2 * hz / s.sound_speed_mps;
  s.twist = request.sonar_moves;
  if (request.switches.doppler) s.doppler_m_per_mps = doppler_metres_per_mps(plan);
  if (s.doppler_m_per_mps != 0) s.max_range_m += std::abs(s.doppler_m_per_mps) * length(s.twist.velocity_mps);
  s.moves = request.switches.motion && (length(s.twist.velocity_mps) > 0 || length(s.twist.angular_rate_radps) > 0);
  if (s.moves) s.seen_at_s = request.settings.range_m / static_cast<double>(request.settings.device_sound_speed_mps);
  // The pulse of a nearer echo ends before the picture. The sonar moves between the scattering of the echo and seen_at_s.
  s.min_range_m =
      (plan.sample_offset - plan.taps) / s.samples_per_m - std::abs(s.doppler_m_per_mps) * length(s.twist.velocity_mps);
  if (s.moves) s.min_range_m -= std::abs(s.seen_at_s - s.min_range_m / s.sound_speed_mps) * length(s.twist.velocity_mps);
  s.min_range_m = std::max(s.min_range_m, 0.0);
  s.seen_from = s.moves ? propagate(request.sonar_in_world, s.twist, s.seen_at_s) : request.sonar_in_world;
  s.world_from_sonar = rotation_from(s.seen_from.orientation);
  s.position_in_scene = to_float(s.seen_from.position_m - scene_origin);
  return s;
}

}  // namespace sonar
