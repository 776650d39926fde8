// Events, and the Response that carries them or an answer.
#include "protocol/control/messages.hpp"

namespace sonar::control {
namespace {

struct FillEvent {
  v1::Event& out;
  void operator()(const PingEvent& e) const {
    v1::PingEvent& m = *out.mutable_ping();
    m.set_sonar(e.sonar);
    m.set_number(e.number);
    m.set_fired_at_ns(e.fired_at_ns);
    fill(*m.mutable_position(), e.sonar_in_world.position_m);
    fill(*m.mutable_orientation(), e.sonar_in_world.orientation);
    m.set_range_m(e.range_m);
    m.set_beams(e.beams);
    m.set_rows(e.rows);
    m.set_clients(e.clients);
    m.set_simulation_ms(e.simulation_ms);
  }
  void operator()(const ClientEvent& e) const {
    v1::ClientEvent& m = *out.mutable_client();
    m.set_sonar(e.sonar);
    m.set_client(e.client);
    m.set_connected(e.connected);
    m.set_why(e.why);
  }
  void operator()(const PoseEvent& e) const {
    v1::PoseEvent& m = *out.mutable_pose();
    m.set_vehicle(e.vehicle);
    m.set_stale(e.stale);
    m.set_text(e.text);
  }
  void operator()(const SceneEvent& e) const {
    v1::SceneEvent& m = *out.mutable_scene();
    m.set_scene(e.scene);
    m.set_text(e.text);
  }
};

PingEvent from(const v1::PingEvent& m) {
  PingEvent e;
  e.sonar = m.sonar();
  e.number = m.number();
  e.fired_at_ns = m.fired_at_ns();
  e.sonar_in_world = pose_from(m.position(), m.orientation());
  e.range_m = m.range_m();
  e.beams = m.beams();
  e.rows = m.rows();
  e.clients = m.clients();
  e.simulation_ms = m.simulation_ms();
  return e;
}

v1::Status::Code code_of(StatusCode code) {
  switch (code) {
    case StatusCode::ok:
      return v1::Status::OK;
    case StatusCode::refused:
      return v1::Status::REFUSED;
    case StatusCode::unsupported:
      return v1::Status::UNSUPPORTED;
    case StatusCode::unauthenticated:
      return v1::Status::UNAUTHENTICATED;
    default:
      return v1::Status::FAILED;
  }
}
/// Codes of later versions are unsupported.
StatusCode code_from(v1::Status::Code code) {
  switch (code) {
    case v1::Status::OK:
      return StatusCode::ok;
    case v1::Status::REFUSED:
      return StatusCode::refused;
    case v1::Status::FAILED:
      return StatusCode::failed;
    case v1::Status::UNAUTHENTICATED:
      return StatusCode::unauthenticated;
    default:
      return StatusCode::unsupported;
  }
}

}  // namespace

void fill(v1::Event& out, const Event& event) {
  std::visit(FillEvent{out}, event.what);
  out.set_unsent(event.unsent);
}

Result<Event> from(const v1::Event& message) {
  Event event;
  event.unsent = message.unsent();
  switch (message.what_case()) {
    case v1::Event::kPing:
      event.what = from(message.ping());
      return event;
    case v1::Event::kClient:
      event.what =
          ClientEvent{message.client().sonar(), message.client().client(), message.client().connected(), message.client().why()};
      return event;
    case v1::Event::kPose:
      event.what = PoseEvent{message.pose().vehicle(), message.pose().stale(), message.pose().text()};
      return event;
    case v1::Event::kScene:
      event.what = SceneEvent{message.scene().scene(), message.scene().text()};
      return event;
    default:
      return failure(ErrorKind::bad_data, "an event of an unknown kind");
  }
}

void fill(v1::Status& out, StatusCode code, const std::string& text) {
  out.set_code(code_of(code));
  out.set_text(text);
}

void fill(v1::Response& out, const Response& response) {
  out.set_id(response.id);
  fill(*out.mutable_status(), response.code, response.text);
  if (response.hello) {
    out.mutable_hello()->set_protocol_version(protocol_version);
    out.mutable_hello()->set_name("sonard");
  } else if (const auto* status = std::get_if<DaemonStatus>(&response.body)) {
    fill(*out.mutable_daemon(), *status);
  } else if (const auto* event = std::get_if<Event>(&response.body)) {
    fill(*out.mutable_event(), *event);
  } else if (const auto* stepped = std::get_if<Stepped>(&response.body)) {
    fill(*out.mutable_stepped(), *stepped);
  }
  repair_texts(out);
}

Result<Response> from(const v1::Response& message) {
  if (const auto where = first_unreal_number(message)) return failure(ErrorKind::bad_data, *where + " is NaN or infinite");
  if (const auto where = first_bad_orientation(message))
    return failure(ErrorKind::bad_data, *where + " is not a quaternion of norm 1");
  Response response;
  response.id = message.id();
  response.code = code_from(message.status().code());
  response.text = message.status().text();
  response.hello = message.has_hello();
  if (message.has_daemon()) response.body = from(message.daemon());
  if (message.has_stepped()) response.body = Stepped{message.stepped().now_ns(), message.stepped().pings()};
  if (message.has_event()) {
    auto event = from(message.event());
    if (!event) return tl::make_unexpected(event.error());
    response.body = *std::move(event);
  }
  return response;
}

}  // namespace sonar::control
