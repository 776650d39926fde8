// Each command has a function here that adds its options to the parser and returns a function that executes it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "clients/sonarctl/commands.hpp"
#include "core/base/result.hpp"
#include "protocol/control/pose_sample.hpp"

namespace CLI {
class App;
class Validator;
}  // namespace CLI

namespace sonar::clients {

using Run = std::function<Result<void>()>;

Run add_listen(CLI::App& app);
Run add_view(CLI::App& app);
Run add_stats(CLI::App& app);
Run add_record(CLI::App& app);
Run add_pose(CLI::App& app);
Run add_doctor(CLI::App& app);
Run add_status(CLI::App& app);
Run add_events(CLI::App& app);
Run add_set(CLI::App& app);
Run add_step(CLI::App& app);
Run add_load(CLI::App& app);
Run add_object(CLI::App& app);
Run add_recording(CLI::App& app);
Run add_fault(CLI::App& app);
Run add_scene(CLI::App& app);
/// `words`: all words after "sonarctl", because they include the command line of another program, which the parser must not read.
Run add_judge(CLI::App& app, const std::vector<std::string>& words);
Run add_farm(CLI::App& app, const std::vector<std::string>& words);
Run add_lab(CLI::App& app, const std::vector<std::string>& words);

/// Runs the command that the arguments name. Returns the exit code of the program.
int run(int argc, char** argv);

// Options that several commands of sonarctl share, and checks in addition to those of core/text/arguments.hpp.

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

// Options for the source of pings and the settings of the sonar. All commands that show or record pings share them, for every
// make.

struct SettingArguments {
  protocol::SettingsOverride settings;
  std::map<std::string, std::string> more;  // options that only some makes have

  /// This object must exist until the command line is parsed.
  void add_to(CLI::App& app);
  /// Returns the options that the user gave.
  protocol::Wanted wanted() const;
};

/// finish() converts the texts to a SourceOptions after parsing.
struct SourceArguments {
  DeviceArguments device;
  bool as_it_is = false, observe = false;
  std::string make, control, sonar;
  std::filesystem::path token_file, recording;
  SettingArguments settings;

  /// `recordings`: adds --from, which reads a recording instead of a sonar. `control_help`: text about the daemon in the help
  /// of --control.
  void add_to(CLI::App& app, bool recordings, const std::string& control_help = "reports the address for observers");
  Result<SourceOptions> finish() const;
};

}  // namespace sonar::clients
