#include <algorithm>
#include <cmath>

#include "clients/sonarctl/doctor/checks.hpp"
#include "core/text/format.hpp"
#include "protocol/control/answers.hpp"
#include "protocol/doctor/judge.hpp"

namespace sonar::clients::doctor {
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
