#include "clients/sonarctl/doctor/checks.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include <nlohmann/json.hpp>

#include "core/text/format.hpp"
#include "core/text/ipv4.hpp"
#include "protocol/control/answers.hpp"
#include "protocol/doctor/judge.hpp"

namespace sonar::clients::doctor {
namespace {

using text::counted;

const char* name_of(Level level) { return level == Level::ok ? "ok" : level == Level::warn ? "warn" : "fail"; }

std::ptrdiff_t count_of(const std::vector<Finding>& findings, Level level) {
  return std::count_if(findings.begin(), findings.end(), [level](const Finding& f) { return f.level == level; });
}

/// Finds pairs of sonars that drivers cannot distinguish.
void check_identities(const StatusFacts& status, std::vector<Finding>& findings) {
  for (std::size_t i = 0; i < status.received.size(); ++i) {
    for (std::size_t k = i + 1; k < status.received.size(); ++k) {
      const ReceivedStatus &a = status.received[i], &b = status.received[k];
      if (a.device_id != b.device_id || a.advertised == b.advertised) continue;
      findings.push_back({Level::warn, "identity",
                          "the sonars at " + a.advertised + " and " + b.advertised + " have the same device id, " +
                              std::to_string(a.device_id) + ": drivers cannot distinguish them",
                          "give each its own device_id in the configuration"});
    }
  }
}

bool reserves(const std::string& list, int port) {
  for (std::size_t begin = 0; begin < list.size();) {
    const std::size_t end = std::min(list.find(',', begin), list.size());
    int low = 0, high = 0;
    const std::string part = list.substr(begin, end - begin);
    const int read = std::sscanf(part.c_str(), "%d-%d", &low, &high);
    if (read == 1) high = low;
    if (read >= 1 && low <= port && port <= high) return true;
    begin = end + 1;
  }
  return false;
}

bool has_come(const StatusFacts& status, const std::string& host) {
  return std::any_of(status.received.begin(), status.received.end(),
                     [&host](const ReceivedStatus& r) { return r.advertised == host || r.from == host; });
}

}  // namespace

std::vector<Finding> run_checks(const Facts& facts) {
  std::vector<Finding> findings;
  for (const SonarFacts& sonar : facts.sonars) check_sonar(facts, sonar, findings);
  check_identities(facts.status, findings);
  check_networks(facts, findings);
  check_daemon(facts, findings);
  check_ports(facts, findings);
  return findings;
}

/// Names the broadcasts, multicasts and streams that a router, a NAT or a bridge does not pass, according to the kinds of a
/// make's ports.
void check_networks(const Facts& facts, std::vector<Finding>& findings) {
  using Kind = protocol::Port::Kind;
  for (const SonarFacts& sonar : facts.sonars) {
    if (!sonar.unresolved.empty() || sonar.at.host.starts_with("127.")) continue;
    const bool is_routed = !sonar.on_this_host && !sonar.in_our_network;
    if (!is_routed && facts.machine == Machine::ordinary) continue;
    std::string lost, instead;
    const auto add = [&](const std::string& what, const std::string& how) {
      lost += (lost.empty() ? "" : ", ") + what, instead += (instead.empty() ? "" : "; ") + how;
    };
    for (const protocol::Port& port : sonar.make->device->ports()) {
      const std::string number = std::to_string(port.number);
      const bool passes = is_routed && has_come(facts.status, sonar.at.host);
      if (port.kind == Kind::udp_beacon && !passes)
        add("its status to udp " + number, "name the driver's computer in status_to of the sonar");
      if (port.kind == Kind::udp_stream && port.group.port != 0)
        add("pings to " + text::format_ipv4(port.group.ip) + ":" + std::to_string(port.group.port),
            "let the driver request pings to its own address instead of the group");
      if (port.kind == Kind::udp_answer) add("searches at udp " + number, "give the driver the address " + sonar.at.host);
    }
    if (lost.empty()) continue;
    const char* const where = is_routed                        ? "in another network"
                              : facts.machine == Machine::wsl2 ? "reached via this WSL2 machine"
                                                               : "reached via this container";
    findings.push_back({is_routed ? Level::warn : Level::ok, "network",
                        sonar.at.host + " is " + where + ": broadcasts and multicasts may not pass (" + lost + ")", instead});
  }
}

/// Reports whether outgoing connections may occupy the ports of the examined sonars.
void check_ports(const Facts& facts, std::vector<Finding>& findings) {
  const KernelPorts& ports = facts.kernel_ports;
  if (!ports.known) return;
  std::set<int> used;
  for (const SonarFacts& sonar : facts.sonars) {
    used.insert(sonar.at.port);
    for (const protocol::Port& port : sonar.make->device->ports())
      if (port.number != 0) used.insert(port.number);
  }
  const std::string range = std::to_string(ports.low) + "-" + std::to_string(ports.high);
  std::string all, exposed;
  bool inside = false;
  for (const int port : used) {
    all.append(all.empty() ? "" : ",").append(std::to_string(port));
    if (port < ports.low || port > ports.high) continue;
    inside = true;
    if (!reserves(ports.reserved, port)) exposed.append(exposed.empty() ? "" : ",").append(std::to_string(port));
  }
  if (used.empty()) return;
  if (exposed.empty())
    return findings.push_back({Level::ok, "ports",
                               (used.size() == 1 ? "port " + all + " is " : "ports " + all + " are ") +
                                   (inside ? std::string("reserved") : "outside the ephemeral range " + range),
                               ""});
  const std::string reserved = ports.reserved.empty() ? exposed : ports.reserved + "," + exposed;
  findings.push_back({Level::warn, "ports",
                      (exposed.find(',') == std::string::npos ? "port " + exposed + " lies" : "ports " + exposed + " lie") +
                          " in the ephemeral range " + range + ": an outgoing connection may occupy one before sonard starts",
                      "to reserve them: sysctl net.ipv4.ip_local_reserved_ports=" + reserved});
}

std::string text_from(const std::vector<Finding>& findings, bool colours) {
  std::string text;
  for (const Finding& f : findings) {
    const char* const colour = f.level == Level::fail ? "31" : f.level == Level::warn ? "33" : "32";  // red, yellow, green
    const std::string level = text::format("%-6s", name_of(f.level));
    text += (colours ? std::string("\x1b[") + colour + "m" + level + "\x1b[0m" : level) + f.text +
            (f.cure.empty() ? "" : "; " + f.cure) + "\n";
  }
  return text + counted(std::ssize(findings), "check") + ", " + counted(count_of(findings, Level::fail), "error") + ", " +
         counted(count_of(findings, Level::warn), "warning") + "\n";
}

std::string json_from(const std::vector<Finding>& findings) {
  nlohmann::json lines = nlohmann::json::array();
  for (const Finding& f : findings)
    lines.push_back({{"level", name_of(f.level)}, {"check", f.check}, {"text", f.text}, {"cure", f.cure}});
  const nlohmann::json out{{"findings", lines},
                           {"checks", findings.size()},
                           {"errors", count_of(findings, Level::fail)},
                           {"warnings", count_of(findings, Level::warn)}};
  return out.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

bool any_failed(const std::vector<Finding>& findings) { return count_of(findings, Level::fail) > 0; }

namespace {

constexpr double largest_clock_difference_s = 0.5;  // stamps of WALL poses are refused from about one second on

void check_control(const Facts& facts, std::vector<Finding>& findings) {
  const ControlFacts& control = facts.control;
  const std::string at = "control tcp " + text_from(control.at);
  if (!control.status) {
    const bool ours = std::any_of(facts.sonars.begin(), facts.sonars.end(), [](const SonarFacts& s) {
      return s.on_this_host && (s.stream.outcome == StreamFacts::Outcome::pings || !s.clients.empty());
    });
    if (!control.given && !control.token_required && (!ours || is_replay(facts.http)))
      return;  // no daemon is expected here: the sonar is on another computer or a recording, or there is none
    if (control.token_required)
      findings.push_back({Level::warn, "control",
                          at + " requires a token, and none was given: poses, clients and engine were not checked",
                          "give it: --token-file FILE, the file named by control.token_file of its configuration"});
    else
      findings.push_back({control.given ? Level::fail : Level::warn, "control", control.error,
                          "without it poses, clients and engine were not checked"});
    return;
  }
  const v1::DaemonStatus& status = *control.status;
  findings.push_back({Level::ok, "control",
                      at + " answers: sonard " + status.version() + ", " + std::to_string(status.sonars_size()) +
                          (status.sonars_size() == 1 ? " sonar, " : " sonars, ") + status.clock() + " clock",
                      ""});
  for (const SonarFacts& sonar : facts.sonars)
    if (served_at(status, sonar) == nullptr)
      findings.push_back({Level::warn, "control",
                          "that sonard does not serve " + sonar.at.host + "; it serves " + served_by(status),
                          "examine one of these, or give the control stream of the sonard that does with --control"});
  if (!status.engine().empty()) findings.push_back({Level::ok, "engine", "trace backend: " + status.engine(), ""});
}

void check_http(const Facts& facts, std::vector<Finding>& findings) {
  const HttpFacts& http = facts.http;
  const std::string url = "http://" + text_from(http.at) + "/healthz";
  if (http.place == HttpFacts::Place::not_served) {
    findings.push_back({Level::ok, "http", "HTTP is not served: no metrics, no curl", ""});
  } else if (http.place == HttpFacts::Place::only_over_there) {
    findings.push_back({Level::ok, "http", url + " accepts only clients on that computer; not checked", ""});
  } else if (http.code == 200) {
    findings.push_back({Level::ok, "http", url + " returns " + http.text, ""});
  } else if (http.code != 0) {
    findings.push_back({http.code >= 500 ? Level::fail : Level::warn, "http",
                        url + " answers " + std::to_string(http.code) + ": " + http.text,
                        http.code == 401 || http.code == 403 ? "it requires a token or another host name, see docs/control.md"
                                                             : "see sonard's log"});
  } else if (http.given || facts.control.status) {
    findings.push_back({http.given ? Level::fail : Level::warn, "http", url + " does not answer: no metrics, no curl",
                        "give its address, control.http of the configuration, with --http HOST:PORT"});
  }
}

/// Returns false if the user gave only the address of another sonar.
bool was_examined(const Facts& facts, const v1::SonarStatus& sonar) {
  return !facts.address_given || std::any_of(facts.sonars.begin(), facts.sonars.end(),
                                             [&sonar](const SonarFacts& s) { return s.at.host == sonar.advertised(); });
}

/// True if nothing answers at the address of the sonar, which another finding reports.
bool is_missing(const Facts& facts, const v1::SonarStatus& sonar) {
  return std::any_of(facts.sonars.begin(), facts.sonars.end(), [&](const SonarFacts& s) {
    const bool is_there =
        s.stream.outcome != StreamFacts::Outcome::refused && s.stream.outcome != StreamFacts::Outcome::unreachable;
    return !is_there && served_at(*facts.control.status, s) == &sonar;
  });
}

/// Lists the addresses of each sonar, and what drivers send and get there.
void list_addresses(const Facts& facts, std::vector<Finding>& findings) {
  for (const v1::SonarStatus& sonar : facts.control.status->sonars())
    if (const std::string all = addresses_of(sonar); !all.empty() && was_examined(facts, sonar) && !is_missing(facts, sonar))
      findings.push_back({Level::ok, "addresses", sonar.name() + ": " + all, ""});
}

/// Reports the sonars of makes that hosts search for.
void check_search(const Facts& facts, std::vector<Finding>& findings) {
  for (const FoundSonar& found : facts.found)
    findings.push_back({Level::ok, std::string(found.make->name()), found.about + " answers discovery at tcp " + found.at, ""});
  if (!facts.control.status) return;
  for (const v1::SonarStatus& sonar : facts.control.status->sonars()) {
    const protocol::Make& make = protocol::make_of_profile(sonar.profile());
    if (make.search == nullptr || !was_examined(facts, sonar)) continue;
    const std::string usual = sonar.advertised() + ":" + std::to_string(make.ports.front().number);
    const auto answered = [&](const FoundSonar& found) { return found.at == usual || found.at == sonar.listens(); };
    const std::string port = "udp " + std::to_string(make.search->port);
    if (std::none_of(facts.found.begin(), facts.found.end(), answered))
      findings.push_back(
          {Level::warn, std::string(make.name()),
           sonar.name() + " at " + sonar.listens() + ", " + std::string(make.title) + ", does not answer discovery on " + port,
           "hosts that are given its address need no discovery; else see whether a firewall drops " + port});
  }
}

void check_clocks(const ControlFacts& control, std::vector<Finding>& findings) {
  if (!control.clock_ahead_s) return;
  const std::string text = text::format("clock of that computer is %.2f s %s this one", std::abs(*control.clock_ahead_s),
                                        *control.clock_ahead_s > 0 ? "ahead of" : "behind");
  if (std::abs(*control.clock_ahead_s) < largest_clock_difference_s)
    findings.push_back({Level::ok, "clock", text, ""});
  else
    findings.push_back({Level::warn, "clock", text + ": poses stamped with WALL time are refused from one second on",
                        "set both by NTP or PTP (timedatectl, chronyc tracking), or send ARRIVAL stamps"});
}

}  // namespace

const v1::SonarStatus* served_at(const v1::DaemonStatus& status, const SonarFacts& sonar) {
  for (const v1::SonarStatus& s : status.sonars())
    if (s.advertised() == sonar.at.host || s.listens() == text_from(sonar.at)) return &s;
  return nullptr;
}

std::string addresses_of(const v1::SonarStatus& sonar) {
  return text::joined(sonar.addresses(), ", ", [](const v1::SonarAddress& address) {
    return address.protocol() + " " + address.address() + (address.carries().empty() ? "" : " (" + address.carries() + ")");
  });
}

std::string served_by(const v1::DaemonStatus& status) {
  std::string all;
  for (const v1::SonarStatus& sonar : status.sonars()) {
    std::string at = sonar.listens().empty() ? sonar.advertised() : sonar.listens();
    for (const v1::SonarAddress& address : sonar.addresses())
      if (!address.sonar_speaks_first()) {
        at = address.protocol() + " " + address.address();
        break;
      }
    all += (all.empty() ? "" : ", ") + sonar.name() + " at " + at;
  }
  return all.empty() ? "no sonar" : all;
}

void check_daemon(const Facts& facts, std::vector<Finding>& findings) {
  check_control(facts, findings);
  if (facts.control.status) list_addresses(facts, findings);
  if (facts.control.status) sonar::doctor::check_poses(*facts.control.status, findings);
  check_http(facts, findings);
  check_search(facts, findings);
  check_clocks(facts.control, findings);
}

}  // namespace sonar::clients::doctor
