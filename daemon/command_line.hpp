// What the user typed. CLI11 is included by command_line.cpp only: it is slow to compile.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "core/base/result.hpp"
#include "daemon/config.hpp"

namespace sonar {

struct RunCommand {
  std::string config;  // empty = search
  bool demo = false;
  std::uint64_t exit_after_pings = 0;
  bool digest = false;
  // Empty = as the configuration says.
  std::string clock, simd, log_format, log_level, bind;
  std::optional<int> threads;
  std::optional<std::uint64_t> seed;
  std::optional<int> fixed_fan;
  bool expected_power = false;                              // false: as the configuration says
  std::array<std::string, named_switches.size()> switches;  // "on", "off", in the order of named_switches
  std::string mode;
};
struct CheckCommand {
  std::string config;
};
struct BenchCommand {
  std::vector<std::string> arguments;
};
struct Leave {  // help, version or a usage error, already printed
  int exit_code = 0;
};
using Command = std::variant<RunCommand, CheckCommand, BenchCommand, Leave>;

Command parse_command_line(int argc, char** argv);
/// What was given on the command line, or stands for it in the environment, wins over the file.
Result<void> override_config(Config& config, const RunCommand& command);

}  // namespace sonar
