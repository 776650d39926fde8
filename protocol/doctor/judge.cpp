#include "protocol/doctor/judge.hpp"

#include <algorithm>
#include <map>
#include <set>

#include "core/text/format.hpp"
#include "protocol/control/answers.hpp"
#include "protocol/host.hpp"

namespace sonar::doctor {
namespace {

/// True if the daemon has a note on the poses of the vehicle. The note replaces the finding that the poses are in order.
bool has_notes(const v1::DaemonStatus& status, const std::string& vehicle) {
  return std::any_of(status.notes().begin(), status.notes().end(),
                     [&vehicle](const v1::Note& note) { return note.vehicle() == vehicle; });
}

}  // namespace

std::string computing_text(double ms_per_ping) {
  const double hz = 1000 / ms_per_ping;
  return "computing takes " + text::format("%.0f", ms_per_ping) + " ms per ping: " + text::format("%.*f", hz < 10 ? 1 : 0, hz) +
         " Hz at most here";
}

void check_poses(const v1::DaemonStatus& status, std::vector<Finding>& findings) {
  for (const v1::VehicleStatus& v : status.vehicles()) {
    if (v.stale())
      findings.push_back({Level::warn, "poses", "poses of " + v.name() + " have stopped, the last came from " + v.source(),
                          "start the sender again, or choose poses.on_stale for the time without poses"});
    else if (!has_notes(status, v.name()))
      findings.push_back({Level::ok, "poses", "poses of " + v.name() + ": " + v.source(), ""});
  }
  for (const v1::Note& note : status.notes()) findings.push_back({Level::warn, "note", note.text(), note.cure()});
  if (status.poses().refused() > 0)
    findings.push_back({Level::warn, "poses",
                        std::to_string(status.poses().refused()) + " messages were refused as poses, " +
                            std::to_string(status.poses().accepted()) + " accepted",
                        "see sonard's log for the reason: not JSON, the frame, a quaternion's norm, a name, the clock"});
}

namespace {

using text::counted;
using text::format;

// The values of Visit::why for connections that ended although their driver made no mistake.
constexpr std::string_view ended_by_fault = "a fault", ended_by_take_over = "another client took over";
constexpr double soon_s = 1;               // time in which a correct driver requests pings, and reads what was sent
constexpr double recent_s = 60;            // earlier visits are not reported
constexpr double enough_of_rate = 0.9;     // share of the requested rate below which the rate is reported
constexpr std::size_t most_elsewhere = 4;  // limit for reported connections to wrong addresses

std::string seconds_text(double s) { return format("%.0f s", s); }

std::string utc_text(std::int64_t ns) {
  const std::int64_t s = ns / 1'000'000'000 % 86'400;
  return format("%02d:%02d:%02d UTC", static_cast<int>(s / 3600), static_cast<int>(s / 60 % 60), static_cast<int>(s % 60));
}
std::string reason_of(const v1::Visit& gone) { return gone.why() + (gone.without_ping() ? ", before its first ping" : ""); }
bool is_recent(const v1::Visit& visit) { return !visit.address().empty() && visit.ago_s() < recent_s; }

std::string addresses_of(const v1::SonarStatus& sonar) { return text::joined(sonar.clients(), ", ", &v1::ClientStatus::address); }

/// Returns the address at which a driver connects, such as "127.0.0.2, TCP port 52100"; without a port if the sonar is controlled
/// over HTTP.
std::string where_to_connect(const v1::SonarStatus& sonar) {
  std::string at = sonar.listens();
  for (const v1::SonarAddress& address : sonar.addresses())
    if (at.empty() && !address.sonar_speaks_first() && address.protocol() == "udp") at = address.address();
  const std::size_t colon = at.rfind(':');
  if (colon == std::string::npos) return sonar.advertised();
  const std::string host = at.substr(0, colon);
  const protocol::Make& make = protocol::make_of_profile(sonar.profile());
  return (host == "0.0.0.0" ? sonar.advertised() : host) + (make.is_by_udp() ? ", UDP port " : ", TCP port ") +
         at.substr(colon + 1);
}

const v1::SonarStatus* find(const v1::DaemonStatus* in, const std::string& name) {
  if (in != nullptr)
    for (const v1::SonarStatus& sonar : in->sonars())
      if (sonar.name() == name) return &sonar;
  return nullptr;
}
const v1::ClientStatus* find(const v1::SonarStatus* in, const std::string& address) {
  if (in != nullptr)
    for (const v1::ClientStatus& client : in->clients())
      if (client.address() == address) return &client;
  return nullptr;
}

/// Makes one finding for each active fault or trouble. In the status the kinds of a trouble are separate faults, so they are
/// collected under the name of the trouble.
void check_faults(const v1::DaemonStatus& status, std::vector<Finding>& findings) {
  std::map<std::pair<std::string, std::string>, std::string> codes;  // codes by sonar and check
  std::set<std::pair<std::string, std::string>> ending;
  for (const v1::FaultStatus& fault : status.faults()) {
    if (fault.state() != "active") continue;
    const std::pair key(fault.sonar(), fault.do_().empty() ? fault.name() : fault.do_());
    std::string& all = codes[key];
    if (fault.code() != key.second) all += (all.empty() ? "" : ", ") + fault.code();
    if (fault.expires_s() > 0) ending.insert(key);
  }
  for (const auto& [key, kinds] : codes)
    findings.push_back({Level::fail, "fault",
                        "A fault acts on " + (key.first.empty() ? "every sonar" : key.first) + ": " + key.second +
                            (kinds.empty() ? "" : " (" + kinds + ")"),
                        std::string(ending.contains(key) ? "it ends by itself, or " : "") + "end it: sonarctl fault reset",
                        key.first, ""});
  if (codes.empty()) findings.push_back({Level::ok, "fault", "No fault acts", ""});
}

/// Makes the findings of one sonar. `before_` is the earlier status of the sonar, for values whose change matters.
class SonarJudge {
 public:
  SonarJudge(const v1::DaemonStatus& status, const v1::SonarStatus& sonar, const v1::DaemonStatus* before,
             std::vector<Finding>& findings)
      : status_(status),
        sonar_(sonar),
        make_(protocol::make_of_profile(sonar.profile())),
        before_(find(before, sonar.name())),
        past_s_(before == nullptr ? 0 : status.uptime_s() - before->uptime_s()),
        findings_(findings) {}

  /// Makes all findings. Without drivers and pings, settings and rates are not checked, because they have no effect then.
  void run() {
    check_places();
    if (sonar_.clients().empty() && !sonar_.pinging()) return check_absence();
    for (const v1::ClientStatus& client : sonar_.clients()) check_client(client);
    check_who_left();
    check_observer();
    check_settings();
    if (sonar_.pinging() && before_ != nullptr && past_s_ > 0) check_rate();
  }

 private:
  void add(Level level, const std::string& check, const std::string& text, const std::string& cure = "",
           const std::string& client = "") {
    findings_.push_back({level, check, text, cure, sonar_.name(), client});
  }

  /// Reports drivers that were refused a slot or that wait for one, unless they are connected now.
  void check_places() {
    const v1::Visit& visit = sonar_.turned_away();
    const std::string holders = sonar_.clients().empty() ? "" : " (" + addresses_of(sonar_) + ")";
    if (sonar_.waiting() > 0)
      add(Level::warn, "places",
          counted(sonar_.waiting(), "client") + " of " + sonar_.name() + (sonar_.waiting() == 1 ? " waits" : " wait") +
              " for a slot" + holders,
          free_a_place);
    if (is_recent(visit) && find(&sonar_, visit.address()) == nullptr)
      add(Level::fail, "places",
          visit.address() + " was refused by " + sonar_.name() + " at " + utc_text(visit.utc_ns()) + ": " + visit.why() + holders,
          free_a_place, visit.address());
    else if (sonar_.waiting() == 0)
      add(Level::ok, "places", "No client of " + sonar_.name() + " was refused in the last minute");
  }

  void check_absence() {
    const v1::Visit &gone = sonar_.gone(), &searched = sonar_.searched();
    std::string last;
    if (!gone.address().empty())
      last = "; the last driver, " + gone.address() + ", left at " + utc_text(gone.utc_ns()) + ": " + reason_of(gone);
    const bool by_http = make_.ports.front().kind == protocol::HostPort::Kind::http;  // no driver stays connected
    const std::string cure =
        by_http ? std::string(make_.remedy) + ", of " + sonar_.advertised() : "point a driver at " + where_to_connect(sonar_);
    add(Level::warn, "driver",
        "No driver is connected to " + sonar_.name() +
            (sonar_.preview() ? "; pings are a preview for viewers alone" : "; nothing is simulated without one") + last,
        cure);
    if (is_recent(searched))
      add(Level::warn, "driver",
          searched.address() + " searched for sonars at " + utc_text(searched.utc_ns()) +
              " and was answered, but has not connected",
          "it must connect to " + where_to_connect(sonar_) + "; a firewall may drop that", searched.address());
    if (gone.without_ping()) check_who_left();
    check_observer();
  }

  void check_observer() {
    const std::string& observer = sonar_.asking_observer();
    if (!observer.empty())
      add(Level::fail, "driver",
          observer + " sends requests to the port of observers of " + sonar_.name() + ", which receive only: they are ignored",
          "point it at " + where_to_connect(sonar_), observer);
  }

  /// Reports the last connection that ended if the sonar or a time-out ended it, but not if the driver disconnected.
  void check_who_left() {
    const v1::Visit& gone = sonar_.gone();
    if (!is_recent(gone) || gone.by_itself()) return;
    // A driver that has connected again and gets pings is reported as a warning only. Its new connection begins after the start
    // of the old one, perhaps before the end. A client of the same host with an earlier connection is another driver.
    const auto host = [](const std::string& address) { return address.substr(0, address.rfind(':')); };
    const bool is_back = std::any_of(sonar_.clients().begin(), sonar_.clients().end(), [&](const v1::ClientStatus& client) {
      return client.pings_written() > 0 && host(client.address()) == host(gone.address()) &&
             client.connected_s() < gone.connected_s();
    });
    const bool by_others = gone.why() == ended_by_fault || gone.why() == ended_by_take_over;
    const bool got_none = gone.without_ping() && !is_back && !by_others;
    add(got_none ? Level::fail : Level::warn, "driver",
        "The connection of " + gone.address() + " ended at " + utc_text(gone.utc_ns()) + ": " + reason_of(gone),
        got_none ? std::string(make_.remedy) : "", gone.address());
  }

  void check_client(const v1::ClientStatus& client) {
    const bool has_fired = client.requests() > 0 || client.pings_written() > 0;
    const bool nobody_gets_pings = std::all_of(sonar_.clients().begin(), sonar_.clients().end(),
                                               [](const v1::ClientStatus& other) { return other.commands_only(); });
    if (client.commands_only() && nobody_gets_pings && has_fired && client.connected_s() >= soon_s)
      add(Level::warn, "driver",
          client.address() + " is connected to " + sonar_.name() + " for commands, but nobody is connected for its pings",
          "connect to the sonar's other ports too; sonarctl status lists them", client.address());
    else if (client.commands_only() && (has_fired || sonar_.pinging()))
      add(Level::ok, "driver", client.address() + " is connected to " + sonar_.name() + " for commands, and gets no pings", "",
          client.address());
    else if (has_fired)
      add(Level::ok, "driver", client.address() + " is connected to " + sonar_.name() + " and has asked for pings", "",
          client.address());
    else if (client.connected_s() >= soon_s)
      check_what_it_sent(client);
    check_reading(client);
  }

  void check_what_it_sent(const v1::ClientStatus& client) {
    std::string sent = "it has sent nothing";
    if (client.bytes_read() > 0)
      sent = "it has sent " + counted(client.bytes_read(), "byte") + ", no valid " + std::string(make_.request) + " among them";
    if (!client.complaint().empty()) sent += " (" + client.complaint() + ")";
    add(sonar_.pinging() ? Level::warn : Level::fail, "driver",
        client.address() + " is connected to " + sonar_.name() + " and has not asked for pings: " + sent,
        std::string(make_.remedy), client.address());
  }

  /// Reports a driver that loses pings: as a fault if it does not read at all, as a warning if it reads too slowly.
  void check_reading(const v1::ClientStatus& client) {
    const v1::ClientStatus* const earlier = find(before_, client.address());
    const std::uint64_t dropped =
        earlier == nullptr ? 0 : client.pings_dropped() - std::min(client.pings_dropped(), earlier->pings_dropped());
    if (client.unread_s() >= soon_s)
      add(Level::fail, "read",
          client.address() + " has not read for " + seconds_text(client.unread_s()) + ": " +
              counted(client.pings_dropped(), "ping") + " dropped, " + std::to_string(client.unsent_bytes() / 1000) +
              " kB on the way",
          "read its socket without pause, in a thread of its own", client.address());
    else if (dropped > 0)
      add(Level::warn, "read",
          client.address() + " reads too slowly: " + counted(dropped, "ping") + " dropped in the last " + seconds_text(past_s_) +
              ", " + std::to_string(client.pings_dropped()) + " since it connected",
          "read its socket without pause, or ask for fewer or smaller pings", client.address());
    else if (client.pings_written() > 0)
      add(Level::ok, "read", client.address() + " receives the pings of " + sonar_.name(), "", client.address());
  }

  void check_settings() {
    if (sonar_.rate_hz() <= 0 && !sonar_.asked_by().empty())
      add(Level::warn, "standby", sonar_.name() + " is in standby: its rate is 0, set by " + sonar_.asked_by(),
          "ask for a rate above 0, or: sonarctl set sonar --rate 10", sonar_.asked_by());
    if (!sonar_.transmits())
      add(Level::warn, "transmit",
          sonar_.name() + " does not transmit, its pings hold noise only" +
              (sonar_.silenced_by().empty() ? "" : "; turned off by " + sonar_.silenced_by()),
          "sonarctl set sonar --transmit on", sonar_.silenced_by());
  }

  void check_rate() {
    const v1::SonarFigures &f = sonar_.figures(), &then = before_->figures();
    if (f.refused() > then.refused())
      return add(Level::fail, "rate",
                 "The engine refused " + counted(f.refused() - then.refused(), "ping") + " of " + sonar_.name(),
                 "see the reason in sonard's log");
    if (status_.clock() != "realtime") return;
    const auto made = static_cast<double>(f.pings() - std::min(f.pings(), then.pings()));
    // Both statuses have the mean computing time since the start; this is the mean for the time between the two statuses.
    const double ms =
        made > 0
            ? (f.simulation_ms() * static_cast<double>(f.pings()) - then.simulation_ms() * static_cast<double>(then.pings())) /
                  made
            : f.simulation_ms();
    const bool skips =
        !sonar_.on_request() && f.skipped_ticks() > then.skipped_ticks() && made < enough_of_rate * sonar_.rate_hz() * past_s_;
    const std::string rates = format("%.1f of %g ", made / past_s_, sonar_.rate_hz()) + std::string(make_.rate_unit());
    if (skips && ms * sonar_.rate_hz() > 1000 * enough_of_rate)
      add(Level::warn, "rate", sonar_.name() + " makes " + rates + ": computing takes " + format("%.0f ms", ms), less_to_compute);
    else if (skips && status_.sonars_size() > 1)
      add(Level::warn, "rate", sonar_.name() + " makes " + rates + ": the other sonars are computed too", less_to_compute);
    else if (made > 0)
      add(Level::ok, "rate", "The engine keeps up with " + sonar_.name());
  }

  const v1::DaemonStatus& status_;
  const v1::SonarStatus& sonar_;
  const protocol::Make& make_;
  const v1::SonarStatus* before_;
  double past_s_;
  std::vector<Finding>& findings_;
};

/// Reports whether time advances and, if not, what it waits for: a client that has not read, a step, or a pose.
void check_clock(const v1::DaemonStatus& now, const v1::DaemonStatus* before, std::vector<Finding>& findings) {
  if (now.clock() == "realtime") return findings.push_back({Level::ok, "clock", "Time runs: clock: realtime", ""});
  const v1::ClientStatus* slowest = nullptr;
  const v1::SonarStatus* of = nullptr;
  bool any_client = false, any_pings = false;
  for (const v1::SonarStatus& sonar : now.sonars()) {
    any_pings = any_pings || sonar.pinging();
    for (const v1::ClientStatus& client : sonar.clients()) {
      any_client = true;
      if (client.unread_s() >= (slowest == nullptr ? soon_s : slowest->unread_s())) slowest = &client, of = &sonar;
    }
  }
  const std::string stands = format("Time stands still at %.3f s: ", 1e-9 * static_cast<double>(now.now_ns()));
  if (slowest != nullptr)
    return findings.push_back({Level::fail, "clock",
                               stands + "it moves when " + slowest->address() + " has taken " +
                                   (slowest->taking() == 0 ? "the message" : "ping " + std::to_string(slowest->taking())) +
                                   "; it has not read for " + seconds_text(slowest->unread_s()),
                               "see what that driver waits for: time waits for the slowest of them", of->name(),
                               slowest->address()});
  if (before == nullptr || before->now_ns() != now.now_ns())
    return findings.push_back({Level::ok, "clock", "Time moves: clock: " + now.clock(), ""});
  if (now.clock() == "lockstep")
    findings.push_back({Level::warn, "clock", stands + "it moves when control asks for a step", "sonarctl step 0.1"});
  else if (now.clock() == "follow")
    findings.push_back({Level::warn, "clock",
                        now.poses().accepted() == 0 ? "Waiting for the first pose: time follows the poses"
                                                    : stands + "it follows the stamps of the poses, and none comes",
                        "start the sender of the poses"});
  else if (any_client)
    findings.push_back({Level::warn, "clock",
                        stands + (any_pings ? "it moves when the last ping is computed and taken"
                                            : "it moves with the pings, and no driver asks for any"),
                        ""});
}

/// Finds programs of this computer that connect to the port of a sonar, but at an address without a sonar.
void check_elsewhere(const v1::DaemonStatus& status, const Elsewhere& elsewhere, std::vector<Finding>& findings) {
  std::set<std::string> ports, ours;
  std::string where;
  for (const v1::SonarStatus& sonar : status.sonars()) {
    const std::size_t colon = sonar.listens().rfind(':');
    if (colon == std::string::npos) continue;
    ports.insert(sonar.listens().substr(colon + 1));
    ours.insert(sonar.listens());
    where += (where.empty() ? "" : "; or at ") + where_to_connect(sonar);
    if (sonar.listens().starts_with("0.0.0.0:")) return;  // the sonar listens at all addresses of this computer
  }
  if (ports.empty()) return;
  const std::string cure = "point the driver at " + where;
  std::map<std::string, Level> texts;
  for (const SocketLine& line : elsewhere.tcp) {
    const std::string port = std::to_string(line.remote_port), to = line.remote_host + ":" + port;
    if (!ports.contains(port) || ours.contains(to) || texts.size() >= most_elsewhere) continue;
    if (line.state == syn_sent)
      texts["A program of this computer tries to connect to " + to + ", and nothing answers there"] = Level::fail;
    if (line.state == established)
      texts["A program of this computer is connected to " + to + ", which is not a sonar of this sonard"] = Level::warn;
  }
  for (const auto& [text, level] : texts) findings.push_back({level, "address", text, cure});
  if (texts.empty() && elsewhere.refused > 0)
    findings.push_back(
        {Level::warn, "address",
         counted(elsewhere.refused, "connection") +
             " of programs of this computer failed in the last seconds: perhaps of a driver with a wrong address or port",
         cure});
}

}  // namespace

bool looks_elsewhere(const v1::DaemonStatus& status) {
  return std::none_of(status.sonars().begin(), status.sonars().end(),
                      [](const v1::SonarStatus& sonar) { return !sonar.clients().empty(); }) &&
         std::none_of(status.faults().begin(), status.faults().end(),
                      [](const v1::FaultStatus& fault) { return fault.state() == "active"; });
}

// Findings of one level are in the order in which they are made: faults, clock, sonars, addresses, poses, engine.
std::vector<Finding> judge(const v1::DaemonStatus& now, const v1::DaemonStatus* before, const Elsewhere& elsewhere) {
  std::vector<Finding> findings;
  check_faults(now, findings);
  check_clock(now, before, findings);
  for (const v1::SonarStatus& sonar : now.sonars()) SonarJudge(now, sonar, before, findings).run();
  if (looks_elsewhere(now)) check_elsewhere(now, elsewhere, findings);
  check_poses(now, findings);
  if (before != nullptr && now.poses().late() > before->poses().late())
    findings.push_back(
        {Level::warn, "poses",
         counted(now.poses().late() - before->poses().late(), "pose") + " came too late to be used: others were newer",
         "send poses in the order of their stamps, with seq counting up"});
  if (!now.engine().empty()) findings.push_back({Level::ok, "engine", "trace backend: " + now.engine(), ""});
  const auto rank = [](const Finding& f) {
    return f.check == "fault" && f.level != Level::ok ? -1 : -static_cast<int>(f.level) + 2;
  };
  std::stable_sort(findings.begin(), findings.end(), [&](const Finding& a, const Finding& b) { return rank(a) < rank(b); });
  return findings;
}

}  // namespace sonar::doctor
