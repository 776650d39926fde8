#include "protocol/control/pose_sample.hpp"

#include <cmath>

namespace sonar::control {
namespace {

constexpr double largest_position_m = 1e8;  // our choice: larger than any local world; sums stay exact to micrometres
constexpr double largest_speed_mps = 1e4;   // our choice: faster than anything that carries a sonar
constexpr double largest_turn_radps = 1e3;

template <std::size_t N>
bool all_within(const std::array<double, N>& values, double limit) {
  for (const double v : values)
    if (!(std::abs(v) <= limit)) return false;  // the comparison is false for NaN
  return true;
}
template <std::size_t N>
bool all_finite(const std::array<double, N>& values) {
  for (const double v : values)
    if (!std::isfinite(v)) return false;
  return true;
}

Vec3d vec(const std::array<double, 3>& v) { return {v[0], v[1], v[2]}; }

}  // namespace

std::string_view name_of(Frame frame) { return frame == Frame::ned_frd ? "NED/FRD" : "ENU/FLU"; }

// This function checks both JSON and protobuf poses, so that both have the same limits and the same texts.
Result<PoseSample> checked(PoseSample sample, const RawPose& raw) {
  if (!raw.frame) return refused("frame is missing: give NED_FRD or ENU_FLU; there is no default");
  if (!all_finite(raw.position_m)) return refused("position has a NaN or infinite component");
  if (!all_within(raw.position_m, largest_position_m)) return refused("position is more than 1e8 m from the origin");
  if (!all_finite(raw.orientation_wxyz)) return refused("orientation has a NaN or infinite component");
  const auto& o = raw.orientation_wxyz;
  const double norm = std::hypot(std::hypot(o[0], o[1]), std::hypot(o[2], o[3]));
  if (!(std::abs(norm - 1) <= largest_norm_error))
    return refused("orientation quaternion has norm " + std::to_string(norm) + ", not 1: normalise it before sending");
  if (raw.velocity_mps && !all_within(*raw.velocity_mps, largest_speed_mps))
    return refused("velocity is NaN, infinite or above 1e4 m/s");
  if (raw.angular_velocity_radps && !all_within(*raw.angular_velocity_radps, largest_turn_radps))
    return refused("angular velocity is NaN, infinite or above 1e3 rad/s");

  const Pose as_sent{vec(raw.position_m), normalized(Quatd{o[0], o[1], o[2], o[3]})};
  const bool ned = *raw.frame == Frame::ned_frd;
  sample.sent_in = *raw.frame;
  sample.sent_angles = raw.sent_angles;
  sample.pose = ned ? enu_flu_from_ned_frd(as_sent) : as_sent;
  if (raw.velocity_mps) sample.velocity_mps = ned ? flu_from_frd(vec(*raw.velocity_mps)) : vec(*raw.velocity_mps);
  if (raw.angular_velocity_radps)
    sample.angular_velocity_radps = ned ? flu_from_frd(vec(*raw.angular_velocity_radps)) : vec(*raw.angular_velocity_radps);
  return sample;
}

}  // namespace sonar::control
