#include "protocol/mavlink/paired_poses.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

namespace sonar::mavlink {
namespace {

using control::Frame;
using control::RawPose;

// MAV_FRAME of common.xml, which since 2019 has only descriptions of 13 to 19, and no names.
enum MavFrame : std::uint8_t {
  local_ned = 1,
  local_enu = 4,
  body_ned = 8,  // deprecated; this and the next one mean body_frd
  body_offset_ned = 9,
  body_frd = 12,
  body_flu = 13,
  mocap_ned = 14,
  mocap_enu = 15,
  vision_ned = 16,
  vision_enu = 17,
  estim_ned = 18,
  estim_enu = 19,
  local_frd = 20,
  local_flu = 21,
};
constexpr std::array frame_names = {"GLOBAL",
                                    "LOCAL_NED",
                                    "MISSION",
                                    "GLOBAL_RELATIVE_ALT",
                                    "LOCAL_ENU",
                                    "GLOBAL_INT",
                                    "GLOBAL_RELATIVE_ALT_INT",
                                    "LOCAL_OFFSET_NED",
                                    "BODY_NED",
                                    "BODY_OFFSET_NED",
                                    "GLOBAL_TERRAIN_ALT",
                                    "GLOBAL_TERRAIN_ALT_INT",
                                    "BODY_FRD",
                                    "BODY_FLU",
                                    "MOCAP_NED",
                                    "MOCAP_ENU",
                                    "VISION_NED",
                                    "VISION_ENU",
                                    "ESTIM_NED",
                                    "ESTIM_ENU",
                                    "LOCAL_FRD",
                                    "LOCAL_FLU"};

std::string frame_text(std::uint8_t frame) {
  return std::to_string(frame) + (frame < frame_names.size() ? std::string(" (") + frame_names[frame] + ")" : "");
}

constexpr double highest_m = 1e5;                               // keeps the results finite; no vehicle with a sonar is higher
const Quatd half_turn_ahead{0, 1, 0, 0};                        // converts FRD to FLU, and back
const Quatd enu_and_ned{0, std::sqrt(0.5), std::sqrt(0.5), 0};  // converts ENU to NED, and back

std::array<double, 3> array_of(Vec3d v) { return {v.x, v.y, v.z}; }
std::array<double, 4> array_of(Quatd q) { return {q.w, q.x, q.y, q.z}; }
Quatd quat_of(const std::array<float, 4>& wxyz) { return {wxyz[0], wxyz[1], wxyz[2], wxyz[3]}; }

RawPose raw_pose(Vec3d ned_m, Quatd frd_in_ned) {
  return {Frame::ned_frd, array_of(ned_m), array_of(frd_in_ned), std::nullopt, std::nullopt};
}
/// Sets the velocities, unless they are NaN, which means unknown.
void set_motion(RawPose& pose, Vec3d frd_mps, Vec3d frd_radps) {
  if (is_finite(frd_mps)) pose.velocity_mps = array_of(frd_mps);
  if (is_finite(frd_radps)) pose.angular_velocity_radps = array_of(frd_radps);
}

Result<std::optional<Geodetic>> geodetic(double latitude_deg, double longitude_deg, double altitude_m) {
  if (latitude_deg == 0 && longitude_deg == 0) return std::nullopt;  // autopilots send this without a fix
  const bool on_earth = std::abs(latitude_deg) <= 90 && std::abs(longitude_deg) <= 180 && std::abs(altitude_m) <= highest_m;
  if (!on_earth)
    return failure(ErrorKind::bad_data, "latitude " + std::to_string(latitude_deg) + ", longitude " +
                                            std::to_string(longitude_deg) + ", altitude " + std::to_string(altitude_m) +
                                            " is not a possible position");
  return Geodetic{rad_from_deg(latitude_deg), rad_from_deg(longitude_deg), altitude_m};
}
Result<std::optional<Geodetic>> geodetic_e7(std::int32_t latitude_e7, std::int32_t longitude_e7, double altitude_m) {
  return geodetic(1e-7 * latitude_e7, 1e-7 * longitude_e7, altitude_m);
}

}  // namespace

AttitudeReading attitude_of(const Attitude& m) {
  return {m.boot_ms, quat_from_rpy({m.roll_rad, m.pitch_rad, m.yaw_rad}), {m.roll_radps, m.pitch_radps, m.yaw_radps}};
}
AttitudeReading attitude_of(const AttitudeQuaternion& m) {
  return {m.boot_ms, {m.w, m.x, m.y, m.z}, {m.roll_radps, m.pitch_radps, m.yaw_radps}};
}

PlaceReading place_of(const LocalPositionNed& m) {
  return {m.boot_ms, {m.north_m, m.east_m, m.down_m}, {m.north_mps, m.east_mps, m.down_mps}};
}

Result<std::optional<Geodetic>> geodetic_of(const GlobalPositionInt& m) {
  return geodetic_e7(m.latitude_e7_deg, m.longitude_e7_deg, 1e-3 * m.altitude_mm);
}
Result<std::optional<Geodetic>> geodetic_of(const GpsGlobalOrigin& m) {
  return geodetic_e7(m.latitude_e7_deg, m.longitude_e7_deg, 1e-3 * m.altitude_mm);
}
bool has_exact_position(const SimState& m) { return m.latitude_e7_deg != 0 || m.longitude_e7_deg != 0; }
Result<std::optional<Geodetic>> geodetic_of(const SimState& m) {
  const double altitude_m = m.altitude_m;
  return has_exact_position(m) ? geodetic_e7(m.latitude_e7_deg, m.longitude_e7_deg, altitude_m)
                               : geodetic(m.latitude_deg, m.longitude_deg, altitude_m);
}

RawPose raw_pose(const AttitudeReading& attitude, const PlaceReading& place) {
  RawPose pose = raw_pose(place.ned_m, attitude.frd_in_ned);
  set_motion(pose, rotate(conjugate(attitude.frd_in_ned), place.ned_mps), attitude.rates_radps);
  return pose;
}

RawPose raw_pose(const SimState& m) {
  const Quatd sent{m.w, m.x, m.y, m.z};
  const bool has_quaternion = norm_squared(sent) > 0.5;  // some simulators fill the angles only
  const Quatd frd_in_ned = has_quaternion ? sent : quat_from_rpy({m.roll_rad, m.pitch_rad, m.yaw_rad});
  return raw_pose(AttitudeReading{0, frd_in_ned, {m.roll_radps, m.pitch_radps, m.yaw_radps}},
                  PlaceReading{0, {}, {m.north_mps, m.east_mps, m.down_mps}});
}

RawPose raw_pose(const AttPosMocap& m) { return raw_pose({m.north_m, m.east_m, m.down_m}, quat_of(m.wxyz)); }
RawPose raw_pose(const VisionPositionEstimate& m) {
  const RollPitchYaw rpy{m.roll_rad, m.pitch_rad, m.yaw_rad};
  RawPose pose = raw_pose({m.north_m, m.east_m, m.down_m}, quat_from_rpy(rpy));
  pose.sent_angles = rpy;
  return pose;
}

Result<RawPose> raw_pose(const Odometry& m) {
  Quatd in_ned = quat_of(m.wxyz);  // axes of the child in NED
  Vec3d ned_m{m.x_m, m.y_m, m.z_m};
  switch (m.frame_id) {
    case local_ned:
    case mocap_ned:
    case vision_ned:
    case estim_ned:
      break;
    case local_frd:  // the direction ahead at the start counts as north
      break;
    case local_enu:
    case mocap_enu:
    case vision_enu:
    case estim_enu:
      ned_m = enu_from_ned(ned_m);  // enu_from_ned() is its own inverse
      in_ned = enu_and_ned * in_ned;
      break;
    case local_flu:
      ned_m = flu_from_frd(ned_m);
      in_ned = half_turn_ahead * in_ned;
      break;
    default:
      return failure(ErrorKind::bad_data, "frame_id " + frame_text(m.frame_id) +
                                              " is not served; send MAV_FRAME_LOCAL_NED, LOCAL_FRD, LOCAL_ENU or LOCAL_FLU");
  }
  Vec3d velocity_mps{m.vx_mps, m.vy_mps, m.vz_mps};
  Vec3d rates_radps{m.roll_radps, m.pitch_radps, m.yaw_radps};
  const bool is_enu = m.frame_id == local_enu || m.frame_id == mocap_enu || m.frame_id == vision_enu || m.frame_id == estim_enu;
  const bool velocity_in_world = m.child_frame_id == m.frame_id && !is_enu && m.frame_id != local_flu;
  if (velocity_in_world) {
    velocity_mps = rotate(conjugate(in_ned), velocity_mps);
  } else if (m.child_frame_id == body_flu) {
    in_ned = in_ned * half_turn_ahead;
    velocity_mps = flu_from_frd(velocity_mps);
    rates_radps = flu_from_frd(rates_radps);
  } else if (m.child_frame_id != body_frd && m.child_frame_id != body_ned && m.child_frame_id != body_offset_ned) {
    return failure(ErrorKind::bad_data,
                   "child_frame_id " + frame_text(m.child_frame_id) + " is not served; send MAV_FRAME_BODY_FRD");
  }
  RawPose pose = raw_pose(ned_m, in_ned);
  set_motion(pose, velocity_mps, rates_radps);
  return pose;
}

namespace {

/// Interpolates linearly over the smaller angle, because attitudes of one vehicle are close to each other.
Quatd between(Quatd a, Quatd b, double u) {
  const double of_b = a.w * b.w + a.x * b.x + a.y * b.y + a.z * b.z < 0 ? -u : u;
  const double of_a = 1 - u;
  const Quatd q{of_a * a.w + of_b * b.w, of_a * a.x + of_b * b.x, of_a * a.y + of_b * b.y, of_a * a.z + of_b * b.z};
  return norm_squared(q) > 0 ? normalized(q) : a;
}

}  // namespace

void Attitudes::put(const AttitudeReading& reading) {
  if (!readings_.empty() && reading.at_ms < readings_.back().at_ms) return;  // late; readings are in the order of time
  if (!readings_.empty() && reading.at_ms == readings_.back().at_ms) readings_.pop_back();
  readings_.push_back(reading);
  if (readings_.size() > most) readings_.pop_front();
}

Attitudes::Answer Attitudes::at(std::int64_t at_ms, AttitudeReading& out) const {
  if (readings_.empty()) return Answer::later;
  const auto after = std::lower_bound(readings_.begin(), readings_.end(), at_ms,
                                      [](const AttitudeReading& r, std::int64_t t) { return r.at_ms < t; });
  if (after == readings_.end()) {  // after the newest reading, extrapolates for a short time
    const AttitudeReading& last = readings_.back();
    const std::int64_t ahead_ms = at_ms - last.at_ms;
    if (ahead_ms > longest_carry_ms) return Answer::later;
    out = last;
    out.at_ms = at_ms;
    if (is_finite(last.rates_radps))
      out.frd_in_ned = last.frd_in_ned * turned_by(1e-3 * static_cast<double>(ahead_ms) * last.rates_radps);
    return Answer::known;
  }
  if (after->at_ms == at_ms) {
    out = *after;
    return Answer::known;
  }
  if (after == readings_.begin()) return Answer::never;
  const AttitudeReading& before = *std::prev(after);
  const std::int64_t gap_ms = after->at_ms - before.at_ms;
  if (gap_ms > longest_gap_ms) return Answer::never;
  const double u = static_cast<double>(at_ms - before.at_ms) / static_cast<double>(gap_ms);
  out = {at_ms, between(before.frd_in_ned, after->frd_in_ned, u), (1 - u) * before.rates_radps + u * after->rates_radps};
  return Answer::known;
}

}  // namespace sonar::mavlink
