#include <algorithm>

#include "clients/sonarctl/doctor/judge.hpp"
#include "core/text/format.hpp"

namespace sonar::clients::doctor {
namespace {

using Outcome = StreamFacts::Outcome;
using text::format;

constexpr double fastest_hz = 40;  // that an Oculus can be asked for
constexpr const char* less_to_compute = "fewer beams, less range, more threads (engine.threads), or less else on this computer";

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : ", ") + word;
  return text;
}

std::string text_of(const PortHolder& holder) {
  if (holder.pid == 0) return "a program of another user";
  return holder.program + " (pid " + std::to_string(holder.pid) + ")";
}

bool is_loopback(const std::string& host) { return host.starts_with("127."); }

const HeardStatus* heard_from(const Facts& facts, const std::string& host) {
  for (const HeardStatus& heard : facts.status.heard)
    if (heard.advertised == host) return &heard;
  for (const HeardStatus& heard : facts.status.heard)
    if (heard.from == host) return &heard;
  return nullptr;
}

/// One sonar's lines; `prefix` names it when there are several.
class SonarJudge {
 public:
  SonarJudge(const Facts& facts, const SonarFacts& sonar, std::vector<Finding>& findings)
      : facts_(facts), sonar_(sonar), findings_(findings), at_("tcp " + text_from(sonar.at)) {
    if (facts.sonars.size() > 1) prefix_ = (sonar.name.empty() ? sonar.at.host : sonar.name) + ": ";
  }

  void judge() {
    if (!sonar_.unresolved.empty()) return add(Level::fail, "address", sonar_.unresolved, "");
    if (sonar_.time_was_over)
      return add(Level::warn, "ping", sonar_.at.host + " was not looked at: the time was over",
                 "give more with --within SECONDS, or its address alone");
    if (!sonar_.blueview) judge_status();
    judge_connection();
    if (sonar_.stream.outcome == Outcome::pings) judge_rate();
    if (sonar_.stream.outcome == Outcome::not_tried) judge_rate_of_others();
  }

 private:
  void add(Level level, const std::string& check, const std::string& text, const std::string& cure) {
    findings_.push_back({level, check, prefix_ + text, cure});
  }

  bool answers() const { return sonar_.stream.outcome >= Outcome::closed_without_a_byte || !sonar_.clients.empty(); }

  void judge_status() {
    const std::string port = std::to_string(facts_.status.on.port);
    const HeardStatus* heard = heard_from(facts_, sonar_.at.host);
    if (!facts_.status.error.empty()) {
      const std::string holder =
          facts_.status.holders.empty() ? "" : ", held without address reuse by " + text_of(facts_.status.holders.front());
      return add(Level::warn, "status", "cannot listen on udp " + port + holder + ": " + facts_.status.error,
                 "a second driver could not either; stop that program to check the broadcast");
    }
    if (heard == nullptr) {
      if (answers()) judge_silence(port);
      return;  // else the connection's line says what is wrong
    }
    if (!heard->complaints.empty())
      return add(Level::fail, "status",
                 "the status from " + heard->from + " is not what drivers expect: " + joined(heard->complaints),
                 "is it a sonar? sonard sends 142 bytes");
    std::string text = "status broadcast received back on udp " + port + " from " + heard->from;
    if (heard->advertised == heard->from) return add(Level::ok, "status", text, "");
    text += ", which tells drivers to connect to " + heard->advertised;
    const bool reachable = answers() && sonar_.at.host == heard->advertised;
    add(reachable ? Level::ok : Level::fail, "status", text + (reachable ? "" : ", where nobody answers"),
        reachable ? "" : "set advertise_ip of the sonar to an address that reaches it from here");
  }

  /// The sonar answers, but its status does not come.
  void judge_silence(const std::string& port) {
    std::string text = "no status from " + sonar_.at.host + " on udp " + port + " within " +
                       format("%.1f", facts_.status.waited_s) + " s: drivers that look for the sonar wait for ever";
    std::string cure =
        "a firewall may drop udp " + port + " (nft list ruleset; ufw status), or status_to of the sonar must name this computer";
    if (sonar_.says)
      cure = "it is sent to " + joined(sonar_.says->status_to) + ": does that reach this computer? See status_to; " +
             (is_loopback(sonar_.at.host) ? "127.255.255.255 reaches every listener here" : "a firewall may drop udp " + port);
    add(Level::fail, "status", text, cure);
  }

  void judge_connection() {
    const StreamFacts& s = sonar_.stream;
    switch (s.outcome) {
      case Outcome::not_tried:
        return add(
            Level::ok, "ping",
            sonar_.at.host + " is busy: " + joined(sonar_.clients) + " is connected and was left alone" + figures_of_daemon(),
            "");
      case Outcome::refused:
        return add(Level::fail, "ping", at_ + " refuses the connection: nobody listens there", where_else());
      case Outcome::unreachable:
        return add(Level::fail, "ping", at_ + " does not answer: " + s.error, way_there());
      case Outcome::closed_without_a_byte:
        return add(Level::warn, "ping",
                   at_ + " closed the connection without a byte: all its places are taken" +
                       (sonar_.clients.empty() ? "" : " (" + joined(sonar_.clients) + ")"),
                   "stop the other client, or raise clients.max of the sonar");
      case Outcome::no_ping:
        return judge_no_ping();
      case Outcome::pings:
        break;
    }
    const std::string first = at_ + " accepts, first ping decoded after " + format("%.0f", s.first_ping_ms) +
                              " ms: " + std::to_string(s.beams) + " beams x " + std::to_string(s.rows) + " ranges, " +
                              std::to_string(s.bits) + " bit, ";
    if (s.broken > 0 || s.junk_bytes > 0)
      return add(Level::fail, "ping",
                 first + (s.broken > 0 ? std::to_string(s.broken) + " of " + std::to_string(s.pings) +
                                             " pings broken: " + s.first_complaint
                                       : std::to_string(s.junk_bytes) + " bytes between messages that belong to none"),
                 "sonarctl listen shows every ping; if this is sonard, it is a fault of ours");
    add(Level::ok, "ping", first + "size fields consistent", "");
  }

  void judge_no_ping() {
    const StreamFacts& s = sonar_.stream;
    const std::string waited = " within " + format("%.1f", s.waited_s) + " s";
    if (!s.error.empty())  // no sonard greets like that
      return add(Level::fail, "ping", s.error, "another program has the port; stop it, or give the sonar's own address");
    if (s.junk_bytes > 0 && s.dummies == 0) {
      std::string who;
      for (const PortHolder& holder : sonar_.listeners) who = ": " + text_of(holder) + " listens on " + holder.at;
      return add(Level::fail, "ping", at_ + " sends " + std::to_string(s.junk_bytes) + " bytes that are no Oculus messages" + who,
                 "another program has the port; stop it, or give the sonar's own address");
    }
    const std::string text = at_ + " accepts, but no ping came" + waited;
    if (!sonar_.listeners.empty() && sonar_.listeners.front().pid != 0 && sonar_.listeners.front().program != "sonard")
      return add(Level::fail, "ping", text + ": " + text_of(sonar_.listeners.front()) + " has the port, not sonard",
                 "stop it, or give the sonar's own address");
    if (sonar_.says && sonar_.says->figures.refused > 0)
      return add(Level::fail, "ping", text + ": the engine refused " + std::to_string(sonar_.says->figures.refused) + " of them",
                 "sonard's log says why");
    if (clock() == "lockstep" || clock() == "follow")
      return add(Level::warn, "ping",
                 text + ": with clock: " + clock() + " time stands until " +
                     (clock() == "lockstep" ? "it is asked to pass" : "the next pose comes"),
                 clock() == "lockstep" ? "let it pass meanwhile: sonarctl step 0.1 --count 20" : "start the sender of poses");
    add(Level::fail, "ping", text,
        s.asked ? "is the computer overloaded, or sonard stopped (SIGSTOP, a debugger)? See its log"
                : "its client asked for standby, or for pings on request; sonarctl status shows the settings");
  }

  /// The daemon's, when it says so: "realtime", "stepped", ...
  std::string clock() const { return facts_.control.status ? facts_.control.status->clock : std::string(); }

  /// Where something does listen.
  std::string where_else() const {
    std::string others;
    for (const PortHolder& daemon : facts_.daemons) others += (others.empty() ? "" : ", ") + daemon.at;
    if (!others.empty()) {
      const std::string host = facts_.daemons.front().at.substr(0, facts_.daemons.front().at.find(':'));
      return text_of(facts_.daemons.front()) + " listens on " + others + ": sonarctl doctor " + host;
    }
    for (const HeardStatus& heard : facts_.status.heard)
      if (heard.advertised != sonar_.at.host)
        return "a status broadcast names a sonar at " + heard.advertised + ": sonarctl doctor " + heard.advertised;
    if (sonar_.on_this_host)
      return "start it: sonard serves its demo on 127.0.0.2 (a BlueView head: sonard --demo blueview), sonard FILE what a "
             "configuration says";
    return "start sonard on that computer; its banner names the address of each sonar";
  }

  std::string way_there() const {
    if (sonar_.on_this_host)
      return "a firewall on this computer may drop tcp " + std::to_string(sonar_.at.port) + " (nft list ruleset)";
    return "the address is not on this host: if sonard should serve it here, add it: ip addr add " + sonar_.at.host +
           "/24 dev eth0; if it is another computer, check that it is on, its network and its firewall";
  }

  std::string figures_of_daemon() const {
    if (!sonar_.says) return " (--take connects anyway)";
    const control::SonarFigures& f = sonar_.says->figures;
    return "; it says " + std::to_string(f.served) + " pings served, " + std::to_string(f.dropped) + " dropped, latency " +
           format("%.0f", f.latency_ms_p50) + " ms p50, " + format("%.0f", f.latency_ms_p99) + " ms p99 (--take connects anyway)";
  }

  std::string latency_text() const {
    const StreamFacts& s = sonar_.stream;
    const auto both = [](double p50, double p99) {
      return ", image latency " + format("%.0f", p50) + " ms p50, " + format("%.0f", p99) + " ms p99";
    };
    if (s.latency_p50_ms) return both(*s.latency_p50_ms, s.latency_p99_ms.value_or(*s.latency_p50_ms));
    if (sonar_.says && sonar_.says->figures.latency_ms_p99 > 0)
      return both(sonar_.says->figures.latency_ms_p50, sonar_.says->figures.latency_ms_p99);
    if (s.spread_p99_ms) return ", images come " + format("%.0f", *s.spread_p99_ms) + " ms later than the promptest, p99";
    return {};
  }

  /// What one ping takes: of those just seen, else the mean since the daemon's start; 0 = not known.
  double computing_ms() const {
    if (sonar_.stream.computing_ms) return *sonar_.stream.computing_ms;
    return sonar_.says ? sonar_.says->figures.simulation_ms : 0;
  }
  bool too_slow_for(double rate_hz) const { return computing_ms() * rate_hz > 1000; }
  std::string computing_text() const {
    const double ms = computing_ms(), hz = 1000 / ms;
    return "computing takes " + format("%.0f", ms) + " ms a ping: " + format("%.*f", hz < 10 ? 1 : 0, hz) + " Hz at most here";
  }

  /// The client that is connected asked for a rate, too.
  void judge_rate_of_others() {
    if (!sonar_.says || !sonar_.says->pinging || clock() != "realtime" || !too_slow_for(sonar_.says->rate_hz)) return;
    add(Level::warn, "rate",
        "rate " + format("%g", sonar_.says->rate_hz) + " Hz asked for by " + joined(sonar_.clients) + ", " + computing_text() +
            ", " + std::to_string(sonar_.says->figures.skipped_ticks) + " ticks skipped",
        less_to_compute);
  }

  void judge_rate() {
    const StreamFacts& s = sonar_.stream;
    if (s.pings < 2)
      return add(Level::warn, "rate", "one ping only in " + format("%.1f", s.waited_s) + " s: no rate can be told",
                 "sonarctl listen " + sonar_.at.host + " looks for longer");
    if (!clock().empty() && clock() != "realtime")
      return add(Level::ok, "rate",
                 format("%.1f", s.rate_hz) + " pings a second of ours; the daemon's time is another (clock: " + clock() +
                     ") and has passed meanwhile",
                 "");
    const double expected_hz = s.asked && !sonar_.blueview ? s.asked_hz : sonar_.says ? sonar_.says->rate_hz : 0;
    std::string text = "rate " + format("%.1f", s.rate_hz) + " Hz";
    if (expected_hz > 0) text += (sonar_.blueview ? " (at most " : " (asked ") + format("%g", expected_hz) + ")";
    text += latency_text();
    const bool slow = expected_hz > 0 && s.rate_hz < 0.85 * expected_hz;
    if (too_slow_for(slow || sonar_.blueview ? expected_hz : fastest_hz)) text += ", " + computing_text();
    if (slow) return add(Level::warn, "rate", text + ": the simulation is slower than the rate", less_to_compute);
    if (s.missing > 0)
      return add(Level::warn, "rate", text + ", " + std::to_string(s.missing) + " pings missing",
                 "the reader or the network is too slow: outbox of the sonar, sonarctl listen");
    add(Level::ok, "rate", text, "");
  }

  const Facts& facts_;
  const SonarFacts& sonar_;
  std::vector<Finding>& findings_;
  std::string at_, prefix_;
};

}  // namespace

void judge_sonar(const Facts& facts, const SonarFacts& sonar, std::vector<Finding>& findings) {
  SonarJudge(facts, sonar, findings).judge();
}

}  // namespace sonar::clients::doctor
