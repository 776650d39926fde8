// Options that several commands of sonarctl share, and checks in addition to those of core/text/arguments.hpp.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "protocol/control/pose_sample.hpp"

namespace CLI {
class App;
class Validator;
}  // namespace CLI

namespace sonar::clients {

/// Checks an option whose value is HOST, HOST:PORT or :PORT.
CLI::Validator address();
CLI::Validator colour_map();

/// Adds --frame: enu or ned, in lower or upper case.
void add_frame_option(CLI::App& command, control::Frame& frame, const std::string& help);
/// Adds --control and --token-file.
void add_control_options(CLI::App& command, std::string& address, std::filesystem::path& token_file);

struct DeviceArguments {
  std::string address;
  std::uint16_t port = 0;  // 0 = the default
  bool discover = false;
  double patience_s = 2;
  /// Adds ADDRESS, --port, --discover and --wait.
  void add_to(CLI::App& command, const std::string& port_help);
};

}  // namespace sonar::clients
