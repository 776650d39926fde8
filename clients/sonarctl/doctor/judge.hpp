// What the facts mean: a line for each check, with the cause and the cure of what is wrong. Pure, so that every line is tested
// without a network.
#pragma once

#include <string>
#include <vector>

#include "clients/sonarctl/doctor/facts.hpp"

namespace sonar::clients::doctor {

enum class Level { ok, warn, fail };
struct Finding {
  Level level = Level::ok;
  std::string check;  // "status", "ping", "rate", "ports", ...: for programs
  std::string text;
  std::string cure;  // empty when all is well
};

std::vector<Finding> judge(const Facts& facts);

/// Parts of it.
void judge_sonar(const Facts& facts, const SonarFacts& sonar, std::vector<Finding>& findings);
void judge_daemon(const Facts& facts, std::vector<Finding>& findings);
void judge_ports(const KernelPorts& ports, std::vector<Finding>& findings);

/// "ok    text" or "warn  text; cure"; lines end with a newline, the last is "5 checks, 0 errors, 1 warning".
std::string text_from(const std::vector<Finding>& findings);
/// One object: findings, and how many of which level.
std::string json_from(const std::vector<Finding>& findings);
bool any_failed(const std::vector<Finding>& findings);

}  // namespace sonar::clients::doctor
