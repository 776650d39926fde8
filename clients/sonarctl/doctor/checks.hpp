// Interprets the facts: one finding per check, with the cause of a fault and a remedy. The functions are pure, so tests need no
// network.
#pragma once

#include <string>
#include <vector>

#include "clients/sonarctl/doctor/facts.hpp"
#include "protocol/doctor/judge.hpp"

namespace sonar::clients::doctor {

using sonar::doctor::Finding;
using sonar::doctor::Level;

std::vector<Finding> run_checks(const Facts& facts);

/// run_checks() calls the next four functions.
void check_sonar(const Facts& facts, const SonarFacts& sonar, std::vector<Finding>& findings);
void check_daemon(const Facts& facts, std::vector<Finding>& findings);
void check_ports(const Facts& facts, std::vector<Finding>& findings);
void check_networks(const Facts& facts, std::vector<Finding>& findings);
/// Returns the sonar that the daemon serves at this address; null if it serves none there.
const v1::SonarStatus* served_at(const v1::DaemonStatus& status, const SonarFacts& sonar);
/// Returns "tcp 127.0.0.2:52100 (settings, pings), status 127.255.255.255:52102 (state)"; empty from an older daemon.
std::string addresses_of(const v1::SonarStatus& sonar);
/// Returns "front at tcp 127.0.0.2:52100, side at udp 127.0.0.3:12345", or "no sonar".
std::string served_by(const v1::DaemonStatus& status);

/// Returns lines such as "ok    text" or "warn  text; cure"; the last is "5 checks, 0 errors, 1 warning". `colours`: the levels
/// have colours, for a terminal.
std::string text_from(const std::vector<Finding>& findings, bool colours = false);
/// Returns a JSON object with the findings and their number for each level.
std::string json_from(const std::vector<Finding>& findings);
bool any_failed(const std::vector<Finding>& findings);

}  // namespace sonar::clients::doctor
