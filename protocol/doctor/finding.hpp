// A finding of doctor: something that works, or a fault with its cause and a remedy. Made by sonarctl doctor from outside, and by
// the daemon from inside for the live view (judge.hpp).
#pragma once

#include <string>

namespace sonar::doctor {

enum class Level { ok, warn, fail };
struct Finding {
  Level level = Level::ok;
  std::string check;  // "status", "ping", "rate", "ports", ...: for programs
  std::string text;
  std::string cure;         // empty for Level::ok
  std::string sonar = {};   // name of the sonar; empty = none
  std::string client = {};  // address of the client; empty = none
};

}  // namespace sonar::doctor
