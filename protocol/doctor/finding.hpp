// A finding of doctor: something that works, or a fault with its cause and a remedy. `sonarctl doctor` makes findings from
// outside; the daemon makes them for the live view (judge.hpp).
#pragma once

#include <string>

namespace sonar::doctor {

enum class Level { ok, warn, fail };
struct Finding {
  Level level = Level::ok;
  std::string check;  // for programs: "status", "ping", "rate", "ports", ...
  std::string text;
  std::string cure;         // empty for Level::ok
  std::string sonar = {};   // name of the sonar; empty = none
  std::string client = {};  // address of the client; empty = none
};

}  // namespace sonar::doctor
