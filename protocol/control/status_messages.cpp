// Converts the daemon's status between plain structs and protobuf.
#include "protocol/control/messages.hpp"

namespace sonar::control {
namespace {

void fill(v1::ClientStatus& out, const ClientStatus& s) {
  out.set_address(s.address);
  out.set_pings_written(s.pings_written);
  out.set_pings_dropped(s.pings_dropped);
  out.set_bytes_written(s.bytes_written);
  out.set_connected_s(s.connected_s);
}
ClientStatus from(const v1::ClientStatus& m) {
  return {m.address(), m.pings_written(), m.pings_dropped(), m.bytes_written(), m.connected_s()};
}

void fill(v1::SonarFigures& out, const SonarFigures& f) {
  out.set_pings(f.pings);
  out.set_refused(f.refused);
  out.set_served(f.served);
  out.set_dropped(f.dropped);
  out.set_skipped_ticks(f.skipped_ticks);
  out.set_clients(f.clients);
  out.set_refused_clients(f.refused_clients);
  out.set_simulation_ms(f.simulation_ms);
  out.set_latency_ms_p50(f.latency_ms_p50);
  out.set_latency_ms_p99(f.latency_ms_p99);
  out.set_late_ms_p99(f.late_ms_p99);
}
SonarFigures from(const v1::SonarFigures& m) {
  return {m.pings(),           m.refused(),       m.served(),         m.dropped(),        m.skipped_ticks(), m.clients(),
          m.refused_clients(), m.simulation_ms(), m.latency_ms_p50(), m.latency_ms_p99(), m.late_ms_p99()};
}

void fill(v1::SonarStatus& out, const SonarStatus& s) {
  out.set_name(s.name);
  out.set_profile(s.profile);
  out.set_listens(s.listens);
  out.set_advertised(s.advertised);
  out.set_observers(s.observers);
  out.set_observing(s.observing);
  for (const std::string& to : s.status_to) out.add_status_to(to);
  out.set_pinging(s.pinging);
  out.set_range_m(s.range_m);
  out.set_rate_hz(s.rate_hz);
  out.set_gain_db(s.gain_db);
  out.set_frequency_hz(s.frequency_hz);
  out.set_beams(s.beams);
  out.set_rows(s.rows);
  out.set_transmits(s.transmits);
  control::fill(*out.mutable_position(), s.in_world.position_m);
  control::fill(*out.mutable_orientation(), s.in_world.orientation);
  for (const ClientStatus& c : s.clients) fill(*out.add_clients(), c);
  fill(*out.mutable_figures(), s.figures);
}
SonarStatus from(const v1::SonarStatus& m) {
  SonarStatus s;
  s.name = m.name();
  s.profile = m.profile();
  s.listens = m.listens();
  s.advertised = m.advertised();
  s.observers = m.observers();
  s.observing = m.observing();
  s.status_to.assign(m.status_to().begin(), m.status_to().end());
  s.pinging = m.pinging();
  s.range_m = m.range_m();
  s.rate_hz = m.rate_hz();
  s.gain_db = m.gain_db();
  s.frequency_hz = m.frequency_hz();
  s.beams = m.beams();
  s.rows = m.rows();
  s.transmits = m.transmits();
  s.in_world = pose_from(m.position(), m.orientation());
  for (const v1::ClientStatus& c : m.clients()) s.clients.push_back(from(c));
  s.figures = from(m.figures());
  return s;
}

void fill(v1::TrajectoryStatus& out, const TrajectoryStatus& s) {
  out.set_file(s.file);
  out.set_position_s(s.position_s);
  out.set_duration_s(s.duration_s);
  out.set_speed(s.speed);
  out.set_paused(s.paused);
  out.set_loop(s.loop);
}
template <class M>
std::optional<TrajectoryStatus> trajectory_of(const M& message) {
  if (!message.has_trajectory()) return std::nullopt;
  const v1::TrajectoryStatus& m = message.trajectory();
  return TrajectoryStatus{m.file(), m.position_s(), m.duration_s(), m.speed(), m.paused(), m.loop()};
}

void fill(v1::VehicleStatus& out, const VehicleStatus& s) {
  out.set_name(s.name);
  out.set_source(s.source);
  out.set_stale(s.stale);
  control::fill(*out.mutable_position(), s.in_world.position_m);
  control::fill(*out.mutable_orientation(), s.in_world.orientation);
  if (s.trajectory) fill(*out.mutable_trajectory(), *s.trajectory);
}
VehicleStatus from(const v1::VehicleStatus& m) {
  return {m.name(), m.source(), m.stale(), pose_from(m.position(), m.orientation()), trajectory_of(m)};
}

void fill(v1::ObjectStatus& out, const ObjectStatus& s) {
  out.set_name(s.name);
  out.set_material(s.material);
  out.set_moving(s.moving);
  out.set_visible(s.visible);
  out.set_triangles(s.triangles);
  control::fill(*out.mutable_position(), s.in_world.position_m);
  control::fill(*out.mutable_orientation(), s.in_world.orientation);
  if (s.trajectory) fill(*out.mutable_trajectory(), *s.trajectory);
}
ObjectStatus from(const v1::ObjectStatus& m) {
  return {m.name(),        m.material(), m.moving(), m.visible(), m.triangles(), pose_from(m.position(), m.orientation()),
          trajectory_of(m)};
}

void fill(v1::PoseFigures& out, const PoseFigures& f) {
  out.set_accepted(f.accepted);
  out.set_refused(f.refused);
  out.set_late(f.late);
  out.set_replaced(f.replaced);
  out.set_over_rate(f.over_rate);
}
PoseFigures from(const v1::PoseFigures& m) { return {m.accepted(), m.refused(), m.late(), m.replaced(), m.over_rate()}; }

void fill(v1::RecordingStatus& out, const RecordingStatus& s) {
  out.set_sonar(s.sonar);
  out.set_file(s.file);
  out.set_running(s.running);
  out.set_pings(s.pings);
  out.set_messages(s.messages);
  out.set_bytes(s.bytes);
  out.set_why(s.why);
}
void fill(v1::Note& out, const Note& note) {
  out.set_vehicle(note.vehicle);
  out.set_text(note.text);
  out.set_cure(note.cure);
}
RecordingStatus from(const v1::RecordingStatus& m) {
  return {m.sonar(), m.file(), m.running(), m.pings(), m.messages(), m.bytes(), m.why()};
}

}  // namespace

void fill(v1::Environment& out, const SetEnvironment& e) {
  if (e.temperature_c) out.mutable_temperature_c()->set_value(*e.temperature_c);
  if (e.salinity_psu) out.mutable_salinity_psu()->set_value(*e.salinity_psu);
  if (e.ph) out.mutable_ph()->set_value(*e.ph);
  if (e.sound_speed_mps) out.mutable_sound_speed_mps()->set_value(*e.sound_speed_mps);
}
SetEnvironment from(const v1::Environment& m) {
  SetEnvironment e;
  if (m.has_temperature_c()) e.temperature_c = m.temperature_c().value();
  if (m.has_salinity_psu()) e.salinity_psu = m.salinity_psu().value();
  if (m.has_ph()) e.ph = m.ph().value();
  if (m.has_sound_speed_mps()) e.sound_speed_mps = m.sound_speed_mps().value();
  return e;
}

void fill(v1::DaemonStatus& out, const DaemonStatus& s) {
  out.set_version(s.version);
  out.set_config(s.config);
  out.set_scene(s.scene);
  out.set_clock(s.clock);
  out.set_engine(s.engine);
  out.set_seed(s.seed);
  out.set_uptime_s(s.uptime_s);
  out.set_resident_mb(s.resident_mb);
  for (const SonarStatus& sonar : s.sonars) fill(*out.add_sonars(), sonar);
  for (const VehicleStatus& vehicle : s.vehicles) fill(*out.add_vehicles(), vehicle);
  for (const ObjectStatus& object : s.objects) fill(*out.add_objects(), object);
  fill(*out.mutable_poses(), s.poses);
  fill(*out.mutable_environment(), s.environment);
  out.set_control(s.control);
  out.set_http(s.http);
  for (const RecordingStatus& recording : s.recordings) fill(*out.add_recordings(), recording);
  out.set_now_ns(s.now_ns);
  for (const Note& note : s.notes) fill(*out.add_notes(), note);
}
void fill(v1::Stepped& out, const Stepped& s) {
  out.set_now_ns(s.now_ns);
  out.set_pings(s.pings);
}
DaemonStatus from(const v1::DaemonStatus& m) {
  DaemonStatus s;
  s.version = m.version();
  s.config = m.config();
  s.scene = m.scene();
  s.clock = m.clock();
  s.engine = m.engine();
  s.seed = m.seed();
  s.uptime_s = m.uptime_s();
  s.resident_mb = m.resident_mb();
  for (const v1::SonarStatus& sonar : m.sonars()) s.sonars.push_back(from(sonar));
  for (const v1::VehicleStatus& vehicle : m.vehicles()) s.vehicles.push_back(from(vehicle));
  for (const v1::ObjectStatus& object : m.objects()) s.objects.push_back(from(object));
  s.poses = from(m.poses());
  s.environment = from(m.environment());
  s.control = m.control();
  s.http = m.http();
  for (const v1::RecordingStatus& recording : m.recordings()) s.recordings.push_back(from(recording));
  s.now_ns = m.now_ns();
  for (const v1::Note& note : m.notes()) s.notes.push_back({note.vehicle(), note.text(), note.cure()});
  return s;
}

}  // namespace sonar::control
