#include "protocol/control/control.hpp"

#include <google/protobuf/stubs/logging.h>

#include <limits>

#include "control.pb.h"

namespace sonar::control {
namespace {

template <class Message>
bool parse(Message& message, BytesView bytes) {
  // The library would write a line of its own for every ill-formed string, as fast as a stranger can send them.
  [[maybe_unused]] static const auto previous = google::protobuf::SetLogHandler(nullptr);
  return bytes.size() <= static_cast<std::size_t>(std::numeric_limits<int>::max()) &&
         message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()));
}
template <class Message>
Bytes serialized(const Message& message) {
  Bytes out(message.ByteSizeLong());
  message.SerializeToArray(out.data(), static_cast<int>(out.size()));
  return out;
}

std::array<double, 3> array_from(const v1::Vec3& v) { return {v.x(), v.y(), v.z()}; }
void fill(v1::Vec3& out, Vec3d v) {
  out.set_x(v.x);
  out.set_y(v.y);
  out.set_z(v.z);
}

Result<Stamp> stamp_from(const v1::Time& time) {
  if (time.ns() > largest_stamp_ns || time.ns() < -largest_stamp_ns)
    return failure(ErrorKind::bad_data, "time.ns is beyond 4.5e18 ns (142 years): send nanoseconds, or ARRIVAL time");
  switch (time.domain()) {
    case v1::CLOCK_UNSPECIFIED:
      if (time.ns() != 0) return failure(ErrorKind::bad_data, "time.domain is missing: say WALL, SIM or ARRIVAL");
      return Stamp{};
    case v1::ARRIVAL:
      return Stamp{};
    case v1::WALL:
      return Stamp{ClockDomain::wall, time.ns()};
    case v1::SIM:
      return Stamp{ClockDomain::sim, time.ns()};
    default:
      return failure(ErrorKind::bad_data, "time.domain has an unknown value");
  }
}

/// PoseUpdate and ObjectUpdate share all but their first and last fields.
template <class Message>
Result<PoseSample> sample_from(const Message& m, PoseSample sample) {
  if (m.frame() != v1::FRAME_UNSPECIFIED && m.frame() != v1::NED_FRD && m.frame() != v1::ENU_FLU)
    return failure(ErrorKind::bad_data, "frame has an unknown value");
  if (!m.has_position()) return failure(ErrorKind::bad_data, "position is missing");
  if (!m.has_orientation()) return failure(ErrorKind::bad_data, "orientation is missing");
  const auto stamp = stamp_from(m.time());
  if (!stamp) return tl::unexpected(stamp.error());
  sample.stamp = *stamp;
  sample.seq = m.seq();
  sample.reset_counter = m.reset_counter();
  RawPose raw;
  if (m.frame() == v1::NED_FRD) raw.frame = Frame::ned_frd;
  if (m.frame() == v1::ENU_FLU) raw.frame = Frame::enu_flu;
  raw.position_m = array_from(m.position());
  raw.orientation_wxyz = {m.orientation().w(), m.orientation().x(), m.orientation().y(), m.orientation().z()};
  sample.fields = "position orientation";
  if (m.has_twist() && m.twist().has_linear()) {
    raw.velocity_mps = array_from(m.twist().linear());
    sample.fields += " velocity";
  }
  if (m.has_twist() && m.twist().has_angular()) {
    raw.angular_velocity_radps = array_from(m.twist().angular());
    sample.fields += " angular_velocity";
  }
  if (stamp->domain != ClockDomain::arrival) sample.fields = "time " + sample.fields;
  return checked(std::move(sample), raw);
}

Result<PoseSample> from(const v1::PoseUpdate& m) {
  PoseSample sample;
  sample.name = m.vehicle();
  return sample_from(m, std::move(sample));
}
Result<PoseSample> from(const v1::ObjectUpdate& m) {
  PoseSample sample;
  sample.of = PoseSample::Of::object;
  sample.name = m.object();
  sample.hidden = m.hidden();
  return sample_from(m, std::move(sample));
}

template <class Message>
void fill_common(Message& m, const PoseSample& s) {
  const bool ned = s.sent_in == Frame::ned_frd;
  const Pose pose = ned ? enu_flu_from_ned_frd(s.pose) : s.pose;  // its own inverse
  m.set_seq(s.seq);
  m.set_frame(ned ? v1::NED_FRD : v1::ENU_FLU);
  m.set_reset_counter(s.reset_counter);
  m.mutable_time()->set_domain(s.stamp.domain == ClockDomain::wall  ? v1::WALL
                               : s.stamp.domain == ClockDomain::sim ? v1::SIM
                                                                    : v1::ARRIVAL);
  m.mutable_time()->set_ns(s.stamp.ns);
  fill(*m.mutable_position(), pose.position_m);
  m.mutable_orientation()->set_w(pose.orientation.w);
  m.mutable_orientation()->set_x(pose.orientation.x);
  m.mutable_orientation()->set_y(pose.orientation.y);
  m.mutable_orientation()->set_z(pose.orientation.z);
  if (s.velocity_mps) fill(*m.mutable_twist()->mutable_linear(), ned ? flu_from_frd(*s.velocity_mps) : *s.velocity_mps);
  if (s.angular_velocity_radps)
    fill(*m.mutable_twist()->mutable_angular(), ned ? flu_from_frd(*s.angular_velocity_radps) : *s.angular_velocity_radps);
}

v1::PoseUpdate pose_update(const PoseSample& s) {
  v1::PoseUpdate m;
  m.set_vehicle(s.name);
  fill_common(m, s);
  return m;
}

}  // namespace

Result<PoseSample> decode_pose_datagram(BytesView datagram) {
  v1::PoseUpdate message;
  if (datagram.size() > largest_datagram) return failure(ErrorKind::bad_data, "pose datagram is longer than 1200 bytes");
  if (datagram.empty() || !parse(message, datagram)) return failure(ErrorKind::bad_data, "datagram is not a PoseUpdate message");
  return from(message);
}

tl::expected<Request, RefusedRequest> decode_request(BytesView bytes) {
  v1::Request message;
  if (!parse(message, bytes)) return tl::unexpected(RefusedRequest{0, "message is not a Request"});
  Request request{message.id(), Unsupported{}};
  if (message.has_hello()) request.op = Hello{message.hello().protocol_version(), message.hello().name()};
  if (message.has_pose() || message.has_object()) {
    auto sample = message.has_pose() ? from(message.pose()) : from(message.object());
    if (!sample) return tl::unexpected(RefusedRequest{message.id(), sample.error().text});
    request.op = *std::move(sample);
  }
  return request;
}

Bytes encode_response(const Response& response) {
  v1::Response message;
  message.set_id(response.id);
  message.mutable_status()->set_code(response.code == StatusCode::ok        ? v1::Status::OK
                                     : response.code == StatusCode::refused ? v1::Status::REFUSED
                                                                            : v1::Status::UNSUPPORTED);
  message.mutable_status()->set_text(response.text);
  if (response.hello) {
    message.mutable_hello()->set_protocol_version(protocol_version);
    message.mutable_hello()->set_name("sonard");
  }
  return serialized(message);
}

Bytes encode_pose_datagram(const PoseSample& sample) { return serialized(pose_update(sample)); }

Bytes encode_request(const Request& request) {
  v1::Request message;
  message.set_id(request.id);
  if (const auto* hello = std::get_if<Hello>(&request.op)) {
    message.mutable_hello()->set_protocol_version(hello->protocol_version);
    message.mutable_hello()->set_name(hello->name);
  }
  if (const auto* sample = std::get_if<PoseSample>(&request.op)) {
    if (sample->of == PoseSample::Of::vehicle) {
      *message.mutable_pose() = pose_update(*sample);
    } else {
      message.mutable_object()->set_object(sample->name);
      message.mutable_object()->set_hidden(sample->hidden);
      fill_common(*message.mutable_object(), *sample);
    }
  }
  return serialized(message);
}

Result<Response> decode_response(BytesView bytes) {
  v1::Response message;
  if (!parse(message, bytes)) return failure(ErrorKind::bad_data, "message is not a Response");
  Response response;
  response.id = message.id();
  response.code = message.status().code() == v1::Status::OK        ? StatusCode::ok
                  : message.status().code() == v1::Status::REFUSED ? StatusCode::refused
                                                                   : StatusCode::unsupported;
  response.text = message.status().text();
  response.hello = message.has_hello();
  return response;
}

}  // namespace sonar::control
