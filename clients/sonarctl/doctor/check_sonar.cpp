#include <algorithm>

#include "clients/sonarctl/doctor/checks.hpp"
#include "core/text/format.hpp"
#include "protocol/control/answers.hpp"
#include "protocol/doctor/judge.hpp"

namespace sonar::clients::doctor {
namespace {

using Outcome = StreamFacts::Outcome;
using sonar::doctor::computing_text;
using sonar::doctor::less_to_compute;
using text::format;
using text::joined;

constexpr double fastest_hz = 40;  // highest rate of an Oculus
constexpr double soon_s = 1;       // a driver requests pings within this time

std::string text_of(const PortHolder& holder) {
  if (holder.pid == 0) return "a program of another user";
  return holder.program + " (pid " + std::to_string(holder.pid) + ")";
}

bool is_loopback(const std::string& host) { return host.starts_with("127."); }

const ReceivedStatus* status_from(const Facts& facts, const std::string& host) {
  for (const ReceivedStatus& received : facts.status.received)
    if (received.advertised == host) return &received;
  for (const ReceivedStatus& received : facts.status.received)
    if (received.from == host) return &received;
  return nullptr;
}

/// The findings of one sonar; `prefix_` names it if there are several.
class SonarChecks {
 public:
  SonarChecks(const Facts& facts, const SonarFacts& sonar, std::vector<Finding>& findings)
      : facts_(facts),
        sonar_(sonar),
        findings_(findings),
        at_((sonar.make->is_by_udp() ? "udp " : "tcp ") + text_from(sonar.at)) {
    if (facts.sonars.size() > 1) prefix_ = (sonar.name.empty() ? sonar.at.host : sonar.name) + ": ";
  }

  void run() {
    if (!sonar_.unresolved.empty()) return add(Level::fail, "address", sonar_.unresolved, "");
    if (sonar_.out_of_time)
      return add(Level::warn, "ping", sonar_.at.host + " was not examined: the time limit was reached",
                 "raise it with --within SECONDS, or give the address of this sonar alone");
    if (is_by_http(sonar_)) return check_images();
    if (sends_status(sonar_, facts_.status)) check_status();
    check_connection();
    if (sonar_.stream.outcome == Outcome::pings) check_rate();
    if (sonar_.stream.outcome == Outcome::not_tried) check_rate_of_others();
    check_drivers();
  }

 private:
  void add(Level level, const std::string& check, const std::string& text, const std::string& cure) {
    findings_.push_back({level, check, prefix_ + text, cure});
  }

  bool answers() const { return sonar_.stream.outcome >= Outcome::closed_without_a_byte || !sonar_.clients.empty(); }

  /// Checks images over UDP, for which no client connects; only the daemon's status shows them.
  void check_images() {
    const std::string at = "http at " + sonar_.at.host;
    if (!sonar_.reported && is_replay(facts_.http))
      return add(Level::ok, "ping", at + ": sends a recording to the receiver that a driver names", "");
    if (!sonar_.reported) return add(Level::warn, "ping", at + ": no daemon reports whether images are sent", "");
    if (!sonar_.reported->pinging()) {
      const std::string& who = sonar_.reported->asked_by();
      const bool is_waited_for = !who.empty();
      return add(is_waited_for ? Level::fail : Level::warn, "ping",
                 at + ": no images are made" + (is_waited_for ? ", although " + who + " has set it up" : ""),
                 std::string(sonar_.make->remedy) + ", of " + sonar_.at.host);
    }
    const double asked_hz = sonar_.reported->rate_hz();
    const v1::SonarFigures& figures = sonar_.reported->figures();
    const std::string text = at + ": images over UDP, " + format("%.1f Hz (%g requested), ", figures.made_hz(), asked_hz) +
                             text::counted(figures.skipped_ticks(), "tick") + " skipped";
    if (too_slow_for(asked_hz))
      add(Level::warn, "ping", text + ", " + computing_text(computing_ms()), less_to_compute);
    else
      add(Level::ok, "ping", text, "");
    check_faults();
  }

  /// If the sonar has no client connections, only faults can be the cause.
  void check_faults() {
    for (const Finding& found : sonar::doctor::judge(*facts_.control.status, nullptr))
      if (found.check == "fault" && found.level != Level::ok && (found.sonar.empty() || found.sonar == sonar_.reported->name()))
        add(found.level, found.check, found.text, found.cure);
  }

  void check_status() {
    const std::string port = std::to_string(facts_.status.on.port);
    const ReceivedStatus* received = status_from(facts_, sonar_.at.host);
    if (!facts_.status.error.empty()) {
      const std::string holder =
          facts_.status.holders.empty() ? "" : ", held without address reuse by " + text_of(facts_.status.holders.front());
      return add(Level::warn, "status", "cannot listen on udp " + port + holder + ": " + facts_.status.error,
                 "a second driver cannot listen either; stop that program to check the broadcast");
    }
    if (received == nullptr) {
      if (answers()) check_silence(port);
      return;  // otherwise the finding on the connection names the error
    }
    if (!received->complaints.empty())
      return add(Level::fail, "status",
                 "the status from " + received->from + " is not what drivers expect: " + joined(received->complaints),
                 "is it a sonar?");
    std::string text = "status broadcast received back on udp " + port + " from " + received->from;
    if (received->advertised == received->from) return add(Level::ok, "status", text, "");
    text += ", which directs drivers to " + received->advertised;
    const bool reachable = answers() && sonar_.at.host == received->advertised;
    add(reachable ? Level::ok : Level::fail, "status", text + (reachable ? "" : ", where no sonar answers"),
        reachable ? "" : "set advertise_ip of the sonar to an address that reaches it from here");
  }

  /// Reports a sonar that answers although its status message does not arrive.
  void check_silence(const std::string& port) {
    std::string text = "no status from " + sonar_.at.host + " on udp " + port + " within " +
                       format("%.1f", facts_.status.waited_s) + " s: drivers that search for the sonar will not find it";
    std::string cure =
        "a firewall may drop udp " + port + " (nft list ruleset; ufw status), or status_to of the sonar must name this computer";
    if (sonar_.reported)
      cure = "it is sent to " + joined(sonar_.reported->status_to()) + ": does that reach this computer? See status_to; " +
             (is_loopback(sonar_.at.host) ? "127.255.255.255 reaches every listener here" : "a firewall may drop udp " + port);
    add(Level::fail, "status", text, cure);
  }

  void check_connection() {
    const StreamFacts& s = sonar_.stream;
    switch (s.outcome) {
      case Outcome::not_tried:
        return add(Level::ok, "ping",
                   sonar_.at.host + " is busy: " + joined(sonar_.clients) + (sonar_.clients.size() > 1 ? " are" : " is") +
                       " connected; not connecting" + stats_of_daemon(),
                   "");
      case Outcome::refused:
        return add(Level::fail, "ping",
                   at_ + (sonar_.make->is_by_udp() ? "" : " refuses the connection") + ": no program listens there",
                   where_else());
      case Outcome::unreachable:
        return add(Level::fail, "ping", at_ + " does not answer: " + s.error, way_there());
      case Outcome::closed_without_a_byte:
        return add(Level::warn, "ping",
                   at_ + " closed the connection without a byte: all its client slots are taken" +
                       (sonar_.clients.empty() ? "" : " (" + joined(sonar_.clients) + ")"),
                   sonar::doctor::free_a_place);
      case Outcome::no_ping:
        return check_no_ping();
      case Outcome::pings:
        break;
    }
    const std::string first = at_ + " accepts, first ping decoded after " + format("%.0f", s.first_ping_ms) +
                              " ms: " + text::counted(s.beams, "beam") + " x " + text::counted(s.rows, "range") + ", " +
                              std::to_string(s.bits) + " bit, ";
    if (s.broken > 0 || s.junk_bytes > 0)
      return add(Level::fail, "ping",
                 first + (s.broken > 0 ? std::to_string(s.broken) + " of " + std::to_string(s.pings) +
                                             " pings broken: " + s.first_complaint
                                       : text::counted(s.junk_bytes, "byte") + " between messages"),
                 "sonarctl listen shows every ping; if this is sonard, please report it");
    add(Level::ok, "ping", first + "size fields consistent", "");
  }

  void check_no_ping() {
    const StreamFacts& s = sonar_.stream;
    const std::string waited = " within " + format("%.1f", s.waited_s) + " s";
    if (s.refuses) return add(Level::fail, "ping", s.error, "sonarctl status shows its settings; see sonard's log");
    if (!s.error.empty())  // the greeting was not sonard's
      return add(Level::fail, "ping", s.error, "another program has the port; stop it, or give the sonar's own address");
    if (s.junk_bytes > 0 && s.others == 0) {
      std::string who;
      for (const PortHolder& holder : sonar_.listeners) who = ": " + text_of(holder) + " listens on " + holder.at;
      return add(Level::fail, "ping",
                 at_ + " sends " + text::counted(s.junk_bytes, "byte") + " in place of messages of " +
                     std::string(sonar_.make->title) + who,
                 "another program has the port; stop it, or give the sonar's own address");
    }
    const std::string text = at_ + " accepts, but no ping came" + waited;
    if (!sonar_.listeners.empty() && sonar_.listeners.front().pid != 0 && sonar_.listeners.front().program != "sonard")
      return add(Level::fail, "ping", text + ": " + text_of(sonar_.listeners.front()) + " has the port, not sonard",
                 "stop it, or give the sonar's own address");
    if (sonar_.reported && sonar_.reported->figures().refused() > 0)
      return add(Level::fail, "ping",
                 text + ": the engine refused " + std::to_string(sonar_.reported->figures().refused()) + " of them",
                 "see the reason in sonard's log");
    if (clock() == "lockstep" || clock() == "follow")
      return add(Level::warn, "ping",
                 text + ": with clock: " + clock() + " time stops until " +
                     (clock() == "lockstep" ? "a client requests a step" : "the next pose comes"),
                 clock() == "lockstep" ? "advance it meanwhile: sonarctl step 0.1 --count 20" : "start the sender of poses");
    if (const std::string rivals = clients_beside_us(); !rivals.empty())
      return add(Level::warn, "ping", text + ": " + rivals + " sent it requests at the same time, and gets its pings",
                 "run the doctor once more: it leaves a busy sonar to its driver");
    add(Level::fail, "ping", text,
        s.asked ? "is the computer overloaded, or sonard stopped (SIGSTOP, a debugger)? See its log"
                : "its client requested standby or single pings; sonarctl status shows the settings");
  }

  /// Lists the clients that connected while this check waited, and got pings.
  std::string clients_beside_us() const {
    std::vector<std::string> rivals;
    if (sonar_.reported)
      for (const v1::ClientStatus& client : sonar_.reported->clients())
        if (client.address() != sonar_.stream.own && client.pings_written() > 0) rivals.push_back(client.address());
    return joined(rivals);
  }

  /// Returns the clock mode that the daemon reports, such as "realtime"; empty without a daemon.
  std::string clock() const { return facts_.control.status ? facts_.control.status->clock() : std::string(); }

  /// Names an address at which a sonar listens.
  std::string where_else() const {
    const v1::SonarStatus* const here = facts_.control.status ? served_at(*facts_.control.status, sonar_) : nullptr;
    if (here != nullptr)
      return "the sonard at " + text_from(facts_.control.at) + " serves it at " +
             (here->addresses().empty() ? here->listens() : addresses_of(*here)) +
             ": use one of these ports; if it is one, sonarctl fault list shows whether a fault has closed it";
    if (facts_.daemons.empty() && is_replay(facts_.http))
      return "sonard replay shows this recording only on its page, http://" + text_from(facts_.http.at);
    const std::string others = joined(facts_.daemons, ", ", &PortHolder::at);
    if (!others.empty())
      return text_of(facts_.daemons.front()) + " listens on " + others + ": sonarctl doctor " + facts_.daemons.front().at;
    for (const ReceivedStatus& received : facts_.status.received)
      if (received.advertised != sonar_.at.host)
        return "a status broadcast names a sonar at " + received.advertised + ": sonarctl doctor " + received.advertised;
    const auto& status = facts_.control.status;
    if (status && status->sonars_size() > 0)
      return "the sonard at " + text_from(facts_.control.at) + " serves " + served_by(*status) + ": sonarctl doctor ADDRESS";
    if (sonar_.on_this_host)
      return "start it: sonard serves its demo on 127.0.0.2 (sonard --help lists those of other makes), sonard FILE the sonars "
             "of a configuration";
    return "start sonard on that computer; its banner names the address of each sonar";
  }

  std::string way_there() const {
    if (sonar_.on_this_host)
      return "a firewall on this computer may drop " + at_.substr(0, 4) + std::to_string(sonar_.at.port) + " (nft list ruleset)";
    return "the address is not on this host: if sonard should serve it here, add it: ip addr add " + sonar_.at.host +
           "/24 dev eth0; if it is another computer, check that it is on, its network and its firewall";
  }

  std::string stats_of_daemon() const {
    if (!sonar_.reported) return " (--take connects nevertheless)";
    const v1::SonarFigures& f = sonar_.reported->figures();
    return "; it reports " + text::counted(f.served(), "ping") + " served, " + std::to_string(f.dropped()) +
           " dropped, latency " + format("%.0f", f.latency_ms_p50()) + " ms p50, " + format("%.0f", f.latency_ms_p99()) +
           " ms p99 (--take connects nevertheless)";
  }

  std::string latency_text() const {
    const StreamFacts& s = sonar_.stream;
    const auto both = [](double p50, double p99) {
      return ", image latency " + format("%.0f", p50) + " ms p50, " + format("%.0f", p99) + " ms p99";
    };
    if (s.latency_p50_ms) return both(*s.latency_p50_ms, s.latency_p99_ms.value_or(*s.latency_p50_ms));
    if (sonar_.reported && sonar_.reported->figures().latency_ms_p99() > 0)
      return both(sonar_.reported->figures().latency_ms_p50(), sonar_.reported->figures().latency_ms_p99());
    if (s.spread_p99_ms) return ", images come " + format("%.0f", *s.spread_p99_ms) + " ms later than the earliest, p99";
    return {};
  }

  /// Returns the computing time of a ping: the median of the received pings, else the mean since the daemon's start; 0 = unknown.
  double computing_ms() const {
    if (sonar_.stream.computing_ms) return *sonar_.stream.computing_ms;
    return sonar_.reported ? sonar_.reported->figures().simulation_ms() : 0;
  }
  bool too_slow_for(double rate_hz) const { return computing_ms() * rate_hz > 1000; }

  /// Checks the rate that another, connected client requested.
  void check_rate_of_others() {
    if (!sonar_.reported || sonar_.make->scans || !sonar_.reported->pinging() || clock() != "realtime" ||
        !too_slow_for(sonar_.reported->rate_hz()))
      return;
    add(Level::warn, "rate",
        "rate " + format("%g", sonar_.reported->rate_hz()) + " Hz requested by " + joined(sonar_.clients) + ", " +
            computing_text(computing_ms()) + ", " + text::counted(sonar_.reported->figures().skipped_ticks(), "tick") +
            " skipped",
        less_to_compute);
  }

  /// Checks the connected drivers with the daemon's status. A driver without pings is an error.
  void check_drivers() {
    if (!sonar_.reported) return;
    const v1::DaemonStatus now = without_us();
    const v1::DaemonStatus* const before =
        now.uptime_s() - facts_.control.status->uptime_s() >= soon_s ? facts_.control.status.get() : nullptr;
    const v1::SonarStatus* const reported = find(now);
    if (reported == nullptr) return;
    const auto gets_pings = [](const v1::ClientStatus& c) { return c.pings_written() > 0; };
    const bool all_get_pings = reported->clients().empty() ||
                               (std::any_of(reported->clients().begin(), reported->clients().end(), gets_pings) &&
                                std::all_of(reported->clients().begin(), reported->clients().end(),
                                            [&](const v1::ClientStatus& c) { return gets_pings(c) || c.commands_only(); }));
    std::vector<Finding> found;
    for (Finding& finding : sonar::doctor::judge(now, before)) {
      if (finding.sonar != reported->name() || finding.level == Level::ok || finding.check == "rate") continue;
      if (finding.check == "places" && all_get_pings)
        finding.level = Level::warn;  // the refused client gets a slot when one leaves
      const bool is_cause = finding.check == "fault" && sonar_.stream.outcome != Outcome::pings;
      if (has_connected() && !is_cause && (finding.client.empty() || finding.level != Level::fail))
        continue;  // this check received pings
      found.push_back(std::move(finding));
    }
    const bool any_fails = std::any_of(found.begin(), found.end(), [](const Finding& f) { return f.level == Level::fail; });
    for (const Finding& f : found) add(f.level, f.check, f.text, f.cure);
    for (const v1::ClientStatus& client : reported->clients())
      if (!any_fails && client.pings_written() == 0 && !client.commands_only() &&
          client.connected_s() >= first_ping_within_s(client, *reported))
        add(Level::fail, "driver",
            client.address() + " is connected and gets no ping" +
                (clock().empty() || clock() == "realtime" ? "" : "; clock: " + clock()),
            found.empty() ? "sonarctl status shows its settings and the clock" : found.front().cure);
  }

  bool has_connected() const { return sonar_.stream.outcome != Outcome::not_tried; }

  const v1::SonarStatus* find(const v1::DaemonStatus& in) const {
    const auto found = std::find_if(in.sonars().begin(), in.sonars().end(),
                                    [this](const v1::SonarStatus& sonar) { return sonar.name() == sonar_.reported->name(); });
    return found == in.sonars().end() ? nullptr : &*found;
  }

  /// Returns the latest status without our own connection, and the clients that left or were refused from the first status.
  v1::DaemonStatus without_us() const {
    const v1::DaemonStatus& first = *facts_.control.status;
    v1::DaemonStatus now = facts_.control.latest ? *facts_.control.latest : first;
    if (!has_connected()) return now;
    for (v1::SonarStatus& sonar : *now.mutable_sonars()) {
      if (sonar.name() != sonar_.reported->name()) continue;
      sonar.clear_gone(), sonar.clear_turned_away();
      if (const v1::SonarStatus* const then = find(first))
        *sonar.mutable_gone() = then->gone(), *sonar.mutable_turned_away() = then->turned_away();
      auto& clients = *sonar.mutable_clients();
      clients.erase(std::remove_if(clients.begin(), clients.end(),
                                   [this](const v1::ClientStatus& client) { return client.address() == sonar_.stream.own; }),
                    clients.end());
    }
    return now;
  }

  /// Returns the time within which a correct driver receives its first ping.
  static double first_ping_within_s(const v1::ClientStatus& client, const v1::SonarStatus& of) {
    if (client.requests() == 0 || of.rate_hz() <= 0) return soon_s;
    return std::max(soon_s, 2 / of.rate_hz() + 2e-3 * of.figures().simulation_ms());
  }

  void check_rate() {
    const StreamFacts& s = sonar_.stream;
    if (s.pings < 2)
      return add(Level::warn, "rate", "one ping only in " + format("%.1f", s.waited_s) + " s: the rate cannot be measured",
                 "sonarctl listen " + sonar_.at.host + " measures for longer");
    if (!clock().empty() && clock() != "realtime")
      return add(Level::ok, "rate",
                 format("%.1f", s.rate_hz) +
                     " pings per second of this computer's clock; the daemon uses another (clock: " + clock() + ")",
                 "");
    const bool is_asked_hz = s.asked && s.asked_hz > 0;
    const double expected_hz = is_asked_hz ? s.asked_hz : sonar_.reported && !sonar_.make->scans ? sonar_.reported->rate_hz() : 0;
    std::string text = "rate " + format("%.1f ", s.rate_hz) + std::string(sonar_.make->rate_unit());
    if (expected_hz > 0)
      text += (sonar_.make->each_ping_requested ? " (at most " : " (requested ") + format("%g", expected_hz) + ")";
    text += latency_text();
    const bool slow = expected_hz > 0 && s.rate_hz < 0.85 * expected_hz;
    const bool is_refuted = too_slow_for(s.rate_hz / 1.2);  // the computer was busier when the known time was measured
    if (!is_refuted && too_slow_for(slow || sonar_.make->each_ping_requested ? expected_hz : fastest_hz))
      text += ", " + computing_text(computing_ms());
    if (slow && !sonar_.reported && is_replay(facts_.http)) return add(Level::ok, "rate", text + ", as in the recording", "");
    if (slow) return add(Level::warn, "rate", text + ": the simulation is slower than the rate", less_to_compute);
    if (s.missing > 0)
      return add(Level::warn, "rate", text + ", " + sonar::text::counted(s.missing, "ping") + " missing",
                 "the reader or the network is too slow: outbox of the sonar, sonarctl listen");
    add(Level::ok, "rate", text, "");
  }

  const Facts& facts_;
  const SonarFacts& sonar_;
  std::vector<Finding>& findings_;
  std::string at_, prefix_;
};

}  // namespace

void check_sonar(const Facts& facts, const SonarFacts& sonar, std::vector<Finding>& findings) {
  SonarChecks(facts, sonar, findings).run();
}

}  // namespace sonar::clients::doctor
