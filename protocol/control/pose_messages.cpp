// Converts poses, placements and mounts between protobuf and our frames.
#include <cmath>

#include "core/base/units.hpp"
#include "protocol/control/answers.hpp"
#include "protocol/control/messages.hpp"

namespace sonar::control {
namespace {

constexpr double furthest_mount_m = 1000;
constexpr double most_degrees = 360;

std::array<double, 3> array_from(const v1::Vec3& v) { return {v.x(), v.y(), v.z()}; }
std::array<double, 4> array_from(const v1::Quat& q) { return {q.w(), q.x(), q.y(), q.z()}; }

/// Reads a stamp. Refuses a stamp without a domain, because WALL and SIM times are mapped to the daemon's clock in different
/// ways. If there is no time, the time of arrival is used.
Result<Stamp> stamp_from(const v1::Time& time) {
  if (time.ns() > largest_stamp_ns || time.ns() < -largest_stamp_ns)
    return refused("time.ns is beyond 4.5e18 ns (142 years): send nanoseconds, or ARRIVAL time");
  switch (time.domain()) {
    case v1::CLOCK_UNSPECIFIED:
      if (time.ns() != 0) return refused("time.domain is missing: give WALL, SIM or ARRIVAL");
      return Stamp{};
    case v1::ARRIVAL:
      return Stamp{};
    case v1::WALL:
      return Stamp{ClockDomain::wall, time.ns()};
    case v1::SIM:
      return Stamp{ClockDomain::sim, time.ns()};
    default:
      return refused("time.domain has an unknown value");
  }
}

/// Reads frame, position and orientation, which PoseUpdate, ObjectUpdate and Placement have.
Result<RawPose> raw_from(const auto& m) {
  if (m.frame() != v1::FRAME_UNSPECIFIED && m.frame() != v1::NED_FRD && m.frame() != v1::ENU_FLU)
    return refused("frame has an unknown value");
  if (!m.has_position()) return refused("position is missing");
  if (!m.has_orientation()) return refused("orientation is missing");
  RawPose raw;
  if (m.frame() == v1::NED_FRD) raw.frame = Frame::ned_frd;
  if (m.frame() == v1::ENU_FLU) raw.frame = Frame::enu_flu;
  raw.position_m = array_from(m.position());
  raw.orientation_wxyz = array_from(m.orientation());
  return raw;
}

/// Reads the fields that PoseUpdate and ObjectUpdate have in common: all but the name and `hidden`.
Result<PoseSample> sample_from(const auto& m, PoseSample sample) {
  auto raw = raw_from(m);
  if (!raw) return tl::make_unexpected(raw.error());
  const auto stamp = stamp_from(m.time());
  if (!stamp) return tl::make_unexpected(stamp.error());
  sample.stamp = *stamp;
  sample.seq = m.seq();
  sample.reset_counter = m.reset_counter();
  sample.fields = "position orientation";
  if (m.has_twist() && m.twist().has_linear()) {
    raw->velocity_mps = array_from(m.twist().linear());
    sample.fields += " velocity";
  }
  if (m.has_twist() && m.twist().has_angular()) {
    raw->angular_velocity_radps = array_from(m.twist().angular());
    sample.fields += " angular_velocity";
  }
  if (stamp->domain != ClockDomain::arrival) sample.fields = "time " + sample.fields;
  return checked(std::move(sample), *raw);
}

void fill_common(auto& m, const PoseSample& s) {
  const bool ned = s.sent_in == Frame::ned_frd;
  const Pose pose = ned ? enu_flu_from_ned_frd(s.pose) : s.pose;  // the conversion is its own inverse
  m.set_seq(s.seq);
  m.set_frame(ned ? v1::NED_FRD : v1::ENU_FLU);
  m.set_reset_counter(s.reset_counter);
  m.mutable_time()->set_domain(s.stamp.domain == ClockDomain::wall  ? v1::WALL
                               : s.stamp.domain == ClockDomain::sim ? v1::SIM
                                                                    : v1::ARRIVAL);
  m.mutable_time()->set_ns(s.stamp.ns);
  fill(*m.mutable_position(), pose.position_m);
  fill(*m.mutable_orientation(), pose.orientation);
  if (s.velocity_mps) fill(*m.mutable_twist()->mutable_linear(), ned ? flu_from_frd(*s.velocity_mps) : *s.velocity_mps);
  if (s.angular_velocity_radps)
    fill(*m.mutable_twist()->mutable_angular(), ned ? flu_from_frd(*s.angular_velocity_radps) : *s.angular_velocity_radps);
}

bool all_within(const v1::Vec3& v, double limit) {
  return std::abs(v.x()) <= limit && std::abs(v.y()) <= limit && std::abs(v.z()) <= limit;  // also false for NaN
}

}  // namespace

Result<PoseSample> from(const v1::PoseUpdate& message) {
  PoseSample sample;
  sample.name = message.vehicle();
  return sample_from(message, std::move(sample));
}
Result<PoseSample> from(const v1::ObjectUpdate& message) {
  PoseSample sample;
  sample.of = PoseSample::Of::object;
  sample.name = message.object();
  sample.hidden = message.hidden();
  return sample_from(message, std::move(sample));
}

Result<Pose> from(const v1::Placement& message) {
  const auto raw = raw_from(message);
  if (!raw) return tl::make_unexpected(raw.error());
  const auto sample = checked({}, *raw);
  if (!sample) return tl::make_unexpected(sample.error());
  return sample->pose;
}

Result<MountChange> from(const v1::Mount& message) {
  if (message.frame() == v1::Mount::FRAME_UNSPECIFIED) return refused("mount.frame is missing: give FRD or FLU");
  if (message.frame() != v1::Mount::FRD && message.frame() != v1::Mount::FLU) return refused("mount.frame has an unknown value");
  if (!all_within(message.position(), furthest_mount_m)) return refused("mount.position is beyond 1000 m");
  if (!all_within(message.rpy_deg(), most_degrees)) return refused("mount.rpy_deg is beyond 360 degrees");
  const v1::Vec3 &p = message.position(), &a = message.rpy_deg();
  const Pose pose{{p.x(), p.y(), p.z()}, quat_from_rpy({rad_from_deg(a.x()), rad_from_deg(a.y()), rad_from_deg(a.z())})};
  const Pose mount = message.frame() == v1::Mount::FRD ? flu_from_frd(pose) : pose;
  MountChange change;
  if (message.has_position()) change.position_m = mount.position_m;
  if (message.has_rpy_deg()) change.orientation = mount.orientation;
  return change;
}

void fill(v1::PoseUpdate& out, const PoseSample& sample) {
  out.set_vehicle(sample.name);
  fill_common(out, sample);
}
void fill(v1::ObjectUpdate& out, const PoseSample& sample) {
  out.set_object(sample.name);
  out.set_hidden(sample.hidden);
  fill_common(out, sample);
}

void fill(v1::Placement& out, const Pose& in_world) {
  out.set_frame(v1::ENU_FLU);
  fill(*out.mutable_position(), in_world.position_m);
  fill(*out.mutable_orientation(), in_world.orientation);
}

void fill(v1::Mount& out, const MountChange& change) {
  out.set_frame(v1::Mount::FLU);
  if (change.position_m) fill(*out.mutable_position(), *change.position_m);
  if (!change.orientation) return;
  const RollPitchYaw a = rpy_from_quat(*change.orientation);
  fill(*out.mutable_rpy_deg(), Vec3d{deg_from_rad(a.roll_rad), deg_from_rad(a.pitch_rad), deg_from_rad(a.yaw_rad)});
}

void fill(v1::Vec3& out, Vec3d v) {
  out.set_x(v.x);
  out.set_y(v.y);
  out.set_z(v.z);
}
void fill(v1::Quat& out, Quatd q) {
  out.set_w(q.w);
  out.set_x(q.x);
  out.set_y(q.y);
  out.set_z(q.z);
}

Pose pose_from(const v1::Vec3& position, const v1::Quat& orientation) {
  const Quatd q{orientation.w(), orientation.x(), orientation.y(), orientation.z()};
  return {{position.x(), position.y(), position.z()}, norm_squared(q) > 0 ? normalized(q) : Quatd{}};
}

}  // namespace sonar::control
