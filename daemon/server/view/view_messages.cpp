#include "daemon/server/view/view_messages.hpp"

#include <cmath>

#include "protocol/control/answers.hpp"
#include "protocol/foxglove/foxglove_messages.hpp"

namespace sonar {
namespace {

ViewPayloadPointer payload_of(Time at, const google::protobuf::MessageLite& message) {
  wire::Bytes bytes(message.ByteSizeLong());
  message.SerializeToArray(bytes.data(), static_cast<int>(bytes.size()));
  return view_payload(at, std::move(bytes));
}

}  // namespace

ViewPayloadPointer ping_payload(const Device& of, const PingQueued& queued) {
  return payload_of(queued.ping->request.fired_at, of.event_of(queued));
}

ViewPayloadPointer figures_payload(const Device& of, const PingQueued& queued) {
  const PingRequest& r = queued.ping->request;
  const DeviceFigures f = of.figures();
  const Vec3d at = r.sonar_in_world.position_m;
  const RollPitchYaw turned = rpy_from_quat(r.sonar_in_world.orientation);
  const double heading_deg = std::fmod(450 - deg_from_rad(turned.yaw_rad), 360);  // clockwise from north
  return view_payload(
      r.fired_at,
      foxglove::figures({seconds(r.fired_at.time_since_epoch()), static_cast<double>(r.number), r.settings.range_m,
                         static_cast<double>(r.settings.rate_hz), 1e3 * queued.simulation_s, 1e3 * f.latency.quantile_s(0.5),
                         static_cast<double>(f.clients_now), static_cast<double>(f.served), static_cast<double>(f.dropped), at.x,
                         at.y, at.z, deg_from_rad(turned.roll_rad), deg_from_rad(turned.pitch_rad), heading_deg}));
}

ViewPayloadPointer faults_payload(Time now, const v1::FaultReport& report) { return payload_of(now, report); }
ViewPayloadPointer status_payload(Time now, const v1::DaemonStatus& status) { return payload_of(now, status); }

}  // namespace sonar
