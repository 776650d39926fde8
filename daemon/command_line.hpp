// What the user typed. CLI11 is included by command_line.cpp only: it is slow to compile.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

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

}  // namespace sonar
