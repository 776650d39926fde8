#include "clients/sonarctl/control/status_text.hpp"

#include <algorithm>
#include <array>
#include <cinttypes>
#include <set>
#include <string_view>

#include "core/text/decimal.hpp"
#include "core/text/format.hpp"
#include "core/text/nearest.hpp"
#include "protocol/control/answers.hpp"
#include "protocol/host.hpp"

namespace sonar::clients {
namespace {

using text::counted;
using text::format;
using text::joined;

constexpr double reported_silence_s = 3;

unsigned long long wide(std::uint64_t value) { return value; }

std::string duration_text(double seconds) {
  const auto whole = static_cast<long long>(seconds);
  if (whole < 120) return format("%lld s", whole);
  if (whole < 7200) return format("%lld min", whole / 60);
  return format("%lld h %lld min", whole / 3600, whole / 60 % 60);
}

std::string line(const char* name, const std::string& text) { return format("%-9s ", name) + text + "\n"; }

/// Returns the requested rate, and the measured rate of pings or of the preview.
std::string rate_text(const v1::SonarStatus& s) {
  std::string text = s.rate_hz() <= 0 ? "standby" : s.on_request() ? "on request" : format("%g Hz", s.rate_hz());
  const double made_hz = s.figures().made_hz();
  if (made_hz <= 0) return text;
  const std::string unit(protocol::make_of_profile(s.profile()).rate_unit());
  return text + format(s.preview() ? ", preview %.1f " : ", measured %.1f ", made_hz) + unit;
}

std::string settings_text(const v1::SonarStatus& s) {
  std::string text = text::frequency_text(s.frequency_hz()) + format("  %.4g m", s.range_m());
  text += "  " + rate_text(s) + format("  gain %.3g dB  %s x %u rows", s.gain_db(), counted(s.beams(), "beam").c_str(), s.rows());
  if (!s.transmits()) text += "  transmitter off";
  return text + (s.pinging() ? "" : "  not pinging");
}

std::string client_text(const v1::ClientStatus& c) {
  std::string text = c.address() + "  ";
  text +=
      c.commands_only() ? "commands only" : format("%llu pings, %llu dropped", wide(c.pings_written()), wide(c.pings_dropped()));
  text += format(", %.1f MB, ", static_cast<double>(c.bytes_written()) / 1e6) + duration_text(c.connected_s());
  return text + (c.silent_s() >= reported_silence_s ? format(", last heard %.0f s ago", c.silent_s()) : "");
}

/// Returns the line of the banner. It says that the sonar waits for a driver only while no client or receiver gets its pings.
std::string address_text(const v1::SonarAddress& a, bool is_listened) {
  if (is_listened && !a.sonar_speaks_first())
    return format("%-10s %-26s %s", a.protocol().c_str(), a.address().c_str(), a.carries().c_str());
  return protocol::line_of(a.protocol(), a.address(), a.carries(), a.sonar_speaks_first());
}

std::string sonar_text(const v1::SonarStatus& s) {
  std::string text = line("sonar", s.name() + "  " + s.profile() + "  " + settings_text(s));
  const bool is_listened = !s.clients().empty() || !s.receivers().empty();
  for (const v1::SonarAddress& a : s.addresses()) text += "          " + address_text(a, is_listened) + "\n";
  if (!s.advertised().empty() && !s.listens().empty() && !s.listens().starts_with(s.advertised() + ":"))
    text += line("", "advertised as " + s.advertised());
  if (!s.observers().empty()) text += line("", format("observers at %s (%u now)", s.observers().c_str(), s.observing()));
  text += line("  place", place_text(control::pose_of(s)));
  const v1::SonarFigures& f = s.figures();
  text +=
      line("  pings", format("%llu simulated, %llu served, %llu dropped, %llu refused, %s skipped", wide(f.pings()),
                             wide(f.served()), wide(f.dropped()), wide(f.refused()), counted(f.skipped_ticks(), "tick").c_str()));
  text += line("  times", format("simulation %.1f ms, latency p50 %.1f ms, p99 %.1f ms, late p99 %.1f ms", f.simulation_ms(),
                                 f.latency_ms_p50(), f.latency_ms_p99(), f.late_ms_p99()));
  text += line("  clients", format("%d now, %llu since the start, %llu refused", s.clients_size(), wide(f.clients()),
                                   wide(f.refused_clients())));
  for (const v1::ClientStatus& c : s.clients()) text += line("  client", client_text(c));
  return text;
}

std::string water_text(const v1::Environment& e) {
  const std::string text = format("%g C, %g psu, pH %g", e.temperature_c().value(), e.salinity_psu().value(), e.ph().value());
  const double speed = e.sound_speed_mps().value();
  return text + (speed > 0 ? format(", sound speed %g m/s", speed) : std::string(", sound speed computed"));
}

/// Describes the trajectory that a vehicle or an object follows.
std::string trajectory_text(const auto& body) {
  if (!body.has_trajectory()) return {};
  const v1::TrajectoryStatus& t = body.trajectory();
  return format("  at %.1f of %.1f s x%g%s%s", t.position_s(), t.duration_s(), t.speed(), t.loop() ? " looped" : "",
                t.paused()                                      ? " paused"
                : !t.loop() && t.position_s() >= t.duration_s() ? " ended"
                                                                : "");
}

std::string recording_text(const v1::RecordingStatus& r) {
  if (r.sonar().empty()) return r.file() + format("  %.1f MB, of an earlier run", static_cast<double>(r.bytes()) / 1e6);
  return r.file() +
         format("  of %s: %s, %s, %.1f MB", r.sonar().c_str(), counted(r.pings(), "ping").c_str(),
                counted(r.messages(), "message").c_str(), static_cast<double>(r.bytes()) / 1e6) +
         (r.running() ? std::string() : "  ended: " + r.why());
}

std::string event_text(const v1::PingEvent& e) {
  return format("ping %u  %s  %.4g m  %s x %u rows  %.1f ms  %s", e.number(), e.sonar().c_str(), e.range_m(),
                counted(e.beams(), "beam").c_str(), e.rows(), e.simulation_ms(), counted(e.clients(), "client").c_str());
}
std::string event_text(const v1::ClientEvent& e) {
  return "client " + e.client() + (e.connected() ? " connected to " : " left ") + e.sonar() +
         (e.why().empty() ? "" : ": " + e.why());
}
std::string event_text(const v1::PoseEvent& e) {
  return "pose " + e.vehicle() + (e.stale() ? " stale" : "") + (e.text().empty() ? "" : ": " + e.text());
}
std::string event_text(const v1::SceneEvent& e) { return "scene " + e.scene() + (e.text().empty() ? "" : ": " + e.text()); }

constexpr std::array<std::string_view, 6> triggers = {"ping", "every", "phase", "time_s", "probability", "on"};

Error wrong(const char* option, const std::string& given, const std::string& why) {
  return {ErrorKind::usage, std::string(option) + " " + given + ": " + why};
}

constexpr int most_still_objects = 12;  // in the status, so that the sonars stay in sight

std::string parameter_text(const v1::FaultParameter& p) {
  const std::string values = joined(p.words(), "|");
  return p.name() + "=" + p.value() + " (" + (values.empty() ? format("%.10g to %.10g", p.lowest(), p.highest()) : values) + ")";
}

}  // namespace

std::string place_text(const Pose& pose) {
  const RollPitchYaw flu = rpy_from_quat(pose.orientation);  // pitch bow down, roll port up
  return format("%.2f %.2f %.2f m, heading %.1f, bow-up pitch %.1f, roll %.1f deg", pose.position_m.x, pose.position_m.y,
                pose.position_m.z, deg_from_rad(heading_rad(pose.orientation)), 0.0 - deg_from_rad(flu.pitch_rad),
                0.0 + deg_from_rad(flu.roll_rad));
}

std::string text_from(const v1::ObjectStatus& o) {
  std::string text = format("%-16s %-12s %7u triangles  at %.2f %.2f %.2f m", o.name().c_str(), o.material().c_str(),
                            o.triangles(), o.position().x(), o.position().y(), o.position().z());
  if (o.moving()) text += "  moving";
  if (!o.visible()) text += "  hidden";
  if (o.has_trajectory()) text += "  trajectory " + o.trajectory().file() + trajectory_text(o);
  return text;
}

/// Returns the time of the clock; empty for real time.
std::string clock_time(const v1::DaemonStatus& s) {
  return s.clock() == "realtime" ? std::string() : format(" at %.3f s", 1e-9 * static_cast<double>(s.now_ns()));
}

std::string text_from(const v1::DaemonStatus& s) {
  std::string text = "sonard " + s.version() + "  up " + duration_text(s.uptime_s()) + format("  %.0f MB\n", s.resident_mb());
  text += line("config", s.config());
  text += line("scene", s.scene() + "  seed " + std::to_string(s.seed()) + "  clock " + s.clock() + clock_time(s));
  text += line("engine", s.engine());
  if (!s.control().empty())  // older daemons do not report it
    text += line("control", "tcp " + s.control() + (s.http().empty() ? std::string("  http off") : "  http " + s.http()));
  text += line("water", water_text(s.environment()));
  for (const v1::SonarStatus& sonar : s.sonars()) text += sonar_text(sonar);
  for (const v1::VehicleStatus& v : s.vehicles())
    text += line("vehicle", v.name() + "  " + place_text(control::pose_of(v)) + "  from " + v.source() +
                                (v.stale() ? "  stale" : "") + trajectory_text(v));
  text += line("poses", format("%llu accepted, %llu refused, %llu late, %llu replaced, %llu over the rate",
                               wide(s.poses().accepted()), wide(s.poses().refused()), wide(s.poses().late()),
                               wide(s.poses().replaced()), wide(s.poses().over_rate())));
  for (const v1::LinkStatus& l : s.links())
    text +=
        line("mavlink", l.endpoint() + "  " + l.vehicle() +
                            format("  %llu distances sent, %llu dropped", wide(l.distances_sent()), wide(l.distances_dropped())));
  for (const v1::Note& n : s.notes()) text += line("note", n.text() + (n.cure().empty() ? "" : "; " + n.cure()));
  for (const v1::RecordingStatus& r : s.recordings()) text += line("recording", recording_text(r));
  int still = 0;
  for (const v1::ObjectStatus& o : s.objects())
    if (o.moving() || ++still <= most_still_objects) text += line("object", text_from(o));
  if (const int more = still - most_still_objects; more > 0)
    text += line("object", std::to_string(more) + " more, which do not move: sonarctl status --json");
  return text;
}

std::string text_from(const v1::Event& event) {
  std::string text = event.has_ping()     ? event_text(event.ping())
                     : event.has_client() ? event_text(event.client())
                     : event.has_pose()   ? event_text(event.pose())
                     : event.has_fault()  ? text_from(event.fault())
                                          : event_text(event.scene());
  if (event.unsent() > 0)
    text += format("  (%llu events before this one were not sent: too slow a reader)", wide(event.unsent()));
  return text;
}

std::string text_from(const v1::FaultEntry& e) {
  std::string text =
      "fault " + e.fault() + (e.fault() == e.kind() ? "" : " (" + e.kind() + ")") + " " + e.event() + "  " + e.sonar();
  if (e.ping() > 0) text += format("  ping %u", e.ping());
  if (!e.client().empty()) text += format("  client %" PRIu64 " %s", e.client_number(), e.client().c_str());
  if (e.offset() >= 0) text += format("  byte %lld", static_cast<long long>(e.offset()));
  if (e.bytes_before() != e.bytes_after())
    text += format("  %" PRIu64 " -> %" PRIu64 " bytes", e.bytes_before(), e.bytes_after());
  const std::set<std::string> names = [&] {  // sorts them, because a map of protobuf has no order
    std::set<std::string> all;
    for (const auto& [name, value] : e.with()) all.insert(name);
    return all;
  }();
  if (e.event() == "began")
    for (const std::string& name : names) text += "  " + name + "=" + e.with().at(name);
  return text;
}

std::string fault_list_text(const v1::FaultReport& report) {
  if (!report.armed()) return "faults are not armed: sonard run --faults, or faults: {armed: true}\n";
  if (report.faults().empty()) return "no faults\n";
  std::vector<const v1::FaultStatus*> faults;  // active ones first, then waiting ones, then ended ones
  int name_width = 16, asked_width = 16;
  for (const v1::FaultStatus& f : report.faults()) {
    faults.push_back(&f);
    name_width = std::max(name_width, static_cast<int>(f.name().size()));
    asked_width = std::max(asked_width, static_cast<int>(f.do_().size()));
  }
  const auto rank = [](const v1::FaultStatus& f) { return f.state() == "active" ? 0 : f.state() == "over" ? 2 : 1; };
  std::stable_sort(faults.begin(), faults.end(), [&](const auto* a, const auto* b) { return rank(*a) < rank(*b); });
  std::string text = format("%-*s %-4s %-*s %-12s %-8s\n", name_width, "NAME", "KIND", asked_width, "ASKED AS", "SONAR", "STATE");
  for (const v1::FaultStatus* const one : faults) {
    const v1::FaultStatus& f = *one;
    text +=
        format("%-*s %-4s %-*s %-12s %-8s %6" PRIu64 " injection%s", name_width, f.name().c_str(), f.code().c_str(), asked_width,
               f.do_().c_str(), f.sonar().c_str(), f.state().c_str(), f.injections(), f.injections() == 1 ? "" : "s");
    if (f.expires_s() > 0) text += format("  ends in %.1f s", f.expires_s());
    text += (f.waits_for().empty() ? "" : "  waits for " + f.waits_for()) + "\n";
  }
  return text;
}

std::string fault_kinds_text(const v1::FaultReport& report) {
  std::string text;
  for (const v1::FaultKind& k : report.kinds()) {
    text += format("%-4s %-22s ", k.code().c_str(), k.name().c_str()) + k.sentence();
    text += k.default_s() > 0 ? format(" %g s.", k.default_s()) : std::string(" Per ping.");
    for (const v1::FaultParameter& p : k.parameters()) text += "  " + parameter_text(p);
    text += "\n";
  }
  for (const v1::Trouble& t : report.troubles()) {
    std::string codes;
    for (const std::string& code : t.codes()) codes += (codes.empty() ? "" : "+") + code;
    text += format("%-27s ", t.name().c_str()) + t.sentence() + " " + codes + "  severity=2 (1|2|3)\n";
  }
  return text;
}

std::string fault_support_text(const v1::FaultReport& report) {
  std::set<std::string> vendors;  // all vendors: each has a kind of fault without effect
  for (const v1::FaultKind& k : report.kinds())
    for (const auto& [vendor, why] : k.without_effect()) vendors.insert(vendor);
  std::string text = "| code | name | tier |", rule = "|---|---|---|";
  for (const std::string& vendor : vendors) {
    text += " " + vendor + " |";
    rule += "---|";
  }
  text += "\n" + rule + "\n";
  for (const v1::FaultKind& k : report.kinds()) {
    text += "| " + k.code() + " | " + k.name() + format(" | %u |", k.tier());
    for (const std::string& vendor : vendors) {
      const auto why = k.without_effect().find(vendor);
      text += " " + (why == k.without_effect().end() ? std::string("takes effect") : why->second) + " |";
    }
    text += "\n";
  }
  return text;
}

Result<void> read_parameters(const std::vector<std::string>& given, control::FaultRecord& record) {
  for (const std::string& pair : given) {
    const std::size_t sign = pair.find('=');
    if (sign == 0 || sign == std::string::npos) return tl::unexpected(wrong("--with", pair, "give NAME=VALUE, such as bytes=16"));
    if (!record.with.emplace(pair.substr(0, sign), pair.substr(sign + 1)).second)
      return tl::unexpected(wrong("--with", pair, "is given twice"));
  }
  return {};
}

Result<void> read_trigger(const std::vector<std::string>& given, control::FaultRecord& record) {
  control::FaultRecord::At& at = record.at;
  for (const std::string& pair : given) {
    const std::size_t sign = std::min(pair.find('='), pair.size());
    const std::string name = pair.substr(0, sign);
    const std::string value = sign < pair.size() ? pair.substr(sign + 1) : std::string();
    if (name == "on") {
      at.on = value;
      if (!value.empty()) continue;
      return tl::unexpected(wrong("--at", pair, "give on=connect, config, status or disconnect"));
    }
    if (name == "time_s" || name == "probability") {
      (name == "time_s" ? at.time_s : at.probability) = text::parse_decimal(value);
      if (name == "time_s" ? at.time_s : at.probability) continue;
      return tl::unexpected(wrong("--at", pair, "is not a number"));
    }
    if (std::find(triggers.begin(), triggers.end(), name) == triggers.end())
      return tl::unexpected(wrong("--at", pair, "give NAME=VALUE" + text::suggestion(name, triggers, "triggers")));
    const auto number = text::parse_unsigned(value);
    if (!number) return tl::unexpected(wrong("--at", pair, "is not a whole number"));
    if (name == "phase")
      at.phase = *number;
    else
      (name == "ping" ? at.ping : at.every) = *number;
  }
  return {};
}

}  // namespace sonar::clients
