#include "clients/sonarctl/doctor/checks.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>

#include "core/text/format.hpp"
#include "core/text/ipv4.hpp"

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

}  // namespace sonar::clients::doctor
