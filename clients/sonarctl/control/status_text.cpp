#include "clients/sonarctl/control/status_text.hpp"

#include <cmath>

#include "core/base/geometry.hpp"
#include "core/text/format.hpp"

namespace sonar::clients {
namespace {

using text::format;

unsigned long long wide(std::uint64_t value) { return value; }

std::string duration_text(double seconds) {
  const auto whole = static_cast<long long>(seconds);
  if (whole < 120) return format("%lld s", whole);
  if (whole < 7200) return format("%lld min", whole / 60);
  return format("%lld h %lld min", whole / 3600, whole / 60 % 60);
}

std::string line(const char* name, const std::string& text) { return format("%-9s ", name) + text + "\n"; }

std::string settings_text(const control::SonarStatus& s) {
  std::string text = text::frequency_text(s.frequency_hz) + format("  %g m", s.range_m);
  text += s.rate_hz > 0 ? format("  %g Hz", s.rate_hz) : std::string("  standby");
  text += format("  gain %.3g dB  %u beams x %u rows", s.gain_db, s.beams, s.rows);
  if (!s.transmits) text += "  transmitter off";
  return text + (s.pinging ? "" : "  not pinging");
}

std::string sonar_text(const control::SonarStatus& s) {
  std::string text = line("sonar", s.name + "  " + s.profile + "  " + settings_text(s));
  std::string links = "tcp " + s.listens;
  if (!s.advertised.empty() && !s.listens.starts_with(s.advertised + ":")) links += "  advertised as " + s.advertised;
  for (const std::string& to : s.status_to) links += "  status -> " + to;
  if (!s.observers.empty()) links += format("  observers at %s (%u now)", s.observers.c_str(), s.observing);
  text += line("  links", links);
  text += line("  place", place_text(s.in_world));
  const control::SonarFigures& f = s.figures;
  text += line("  pings", format("%llu simulated, %llu served, %llu dropped, %llu refused, %llu ticks skipped", wide(f.pings),
                                 wide(f.served), wide(f.dropped), wide(f.refused), wide(f.skipped_ticks)));
  text += line("  times", format("simulation %.1f ms, latency p50 %.1f ms, p99 %.1f ms, late p99 %.1f ms", f.simulation_ms,
                                 f.latency_ms_p50, f.latency_ms_p99, f.late_ms_p99));
  text += line("  clients",
               format("%zu now, %llu since the start, %llu refused", s.clients.size(), wide(f.clients), wide(f.refused_clients)));
  for (const control::ClientStatus& c : s.clients)
    text += line("  client", format("%s  %llu pings, %llu dropped, %.1f MB, ", c.address.c_str(), wide(c.pings_written),
                                    wide(c.pings_dropped), static_cast<double>(c.bytes_written) / 1e6) +
                                 duration_text(c.connected_s));
  return text;
}

std::string water_text(const control::SetEnvironment& e) {
  std::string text =
      format("%g C, %g psu, pH %g", e.temperature_c.value_or(NAN), e.salinity_psu.value_or(NAN), e.ph.value_or(NAN));
  const double speed = e.sound_speed_mps.value_or(0);
  return text + (speed > 0 ? format(", sound speed %g m/s", speed) : std::string(", sound speed computed"));
}

std::string trajectory_text(const std::optional<control::TrajectoryStatus>& t) {
  if (!t) return {};
  return format("  at %.1f of %.1f s x%g%s%s", t->position_s, t->duration_s, t->speed, t->loop ? " looped" : "",
                t->paused                                    ? " paused"
                : !t->loop && t->position_s >= t->duration_s ? " ended"
                                                             : "");
}

std::string recording_text(const control::RecordingStatus& r) {
  return r.file +
         format("  of %s: %llu ping%s, %llu message%s, %.1f MB", r.sonar.c_str(), wide(r.pings), r.pings == 1 ? "" : "s",
                wide(r.messages), r.messages == 1 ? "" : "s", static_cast<double>(r.bytes) / 1e6) +
         (r.running ? std::string() : "  ended: " + r.why);
}

std::string event_text(const control::PingEvent& e) {
  return format("ping %u  %s  %g m  %u beams x %u rows  %.1f ms  %u client%s", e.number, e.sonar.c_str(), e.range_m, e.beams,
                e.rows, e.simulation_ms, e.clients, e.clients == 1 ? "" : "s");
}
std::string event_text(const control::ClientEvent& e) {
  return "client " + e.client + (e.connected ? " connected to " : " left ") + e.sonar + (e.why.empty() ? "" : ": " + e.why);
}
std::string event_text(const control::PoseEvent& e) {
  return "pose " + e.vehicle + (e.stale ? " stale" : "") + (e.text.empty() ? "" : ": " + e.text);
}
std::string event_text(const control::SceneEvent& e) { return "scene " + e.scene + (e.text.empty() ? "" : ": " + e.text); }

}  // namespace

std::string place_text(const Pose& pose) {
  const RollPitchYaw flu = rpy_from_quat(pose.orientation);  // pitch bow down, roll port up
  return format("%.2f %.2f %.2f m, heading %.1f, pitch %.1f, roll %.1f deg", pose.position_m.x, pose.position_m.y,
                pose.position_m.z, deg_from_rad(heading_rad(pose.orientation)), 0.0 - deg_from_rad(flu.pitch_rad),
                0.0 + deg_from_rad(flu.roll_rad));
}

std::string text_from(const control::ObjectStatus& o) {
  std::string text = format("%-16s %-12s %7u triangles  at %.2f %.2f %.2f m", o.name.c_str(), o.material.c_str(), o.triangles,
                            o.in_world.position_m.x, o.in_world.position_m.y, o.in_world.position_m.z);
  if (o.moving) text += "  moving";
  if (!o.visible) text += "  hidden";
  if (o.trajectory) text += "  trajectory " + o.trajectory->file + trajectory_text(o.trajectory);
  return text;
}

/// Only for clocks other than real time.
std::string clock_time(const control::DaemonStatus& s) {
  return s.clock == "realtime" ? std::string() : format(" at %.3f s", 1e-9 * static_cast<double>(s.now_ns));
}

std::string text_from(const control::DaemonStatus& s) {
  std::string text = "sonard " + s.version + "  up " + duration_text(s.uptime_s) + format("  %.0f MB\n", s.resident_mb);
  text += line("config", s.config);
  text += line("scene", s.scene + "  seed " + std::to_string(s.seed) + "  clock " + s.clock + clock_time(s));
  text += line("engine", s.engine);
  if (!s.control.empty())  // older daemons do not report it
    text += line("control", "tcp " + s.control + (s.http.empty() ? std::string("  http off") : "  http " + s.http));
  text += line("water", water_text(s.environment));
  for (const control::SonarStatus& sonar : s.sonars) text += sonar_text(sonar);
  for (const control::VehicleStatus& v : s.vehicles)
    text += line("vehicle", v.name + "  " + place_text(v.in_world) + "  from " + v.source + (v.stale ? "  stale" : "") +
                                trajectory_text(v.trajectory));
  text +=
      line("poses", format("%llu accepted, %llu refused, %llu late, %llu replaced, %llu over the rate", wide(s.poses.accepted),
                           wide(s.poses.refused), wide(s.poses.late), wide(s.poses.replaced), wide(s.poses.over_rate)));
  for (const control::Note& n : s.notes) text += line("note", n.text + (n.cure.empty() ? "" : "; " + n.cure));
  for (const control::RecordingStatus& r : s.recordings) text += line("recording", recording_text(r));
  for (const control::ObjectStatus& o : s.objects) text += line("object", text_from(o));
  return text;
}

std::string text_from(const control::Event& event) {
  std::string text = std::visit([](const auto& what) { return event_text(what); }, event.what);
  if (event.unsent > 0) text += format("  (%llu events before this one were not sent: too slow a reader)", wide(event.unsent));
  return text;
}

}  // namespace sonar::clients
