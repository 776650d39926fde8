// Options for the source of pings and the settings of the sonar. All commands that show or record pings share them, for every
// make.
#pragma once

#include <CLI/App.hpp>
#include <map>
#include <string>

#include "clients/sonarctl/argument_checks.hpp"
#include "clients/sonarctl/commands.hpp"

namespace sonar::clients {

struct SettingArguments {
  protocol::SettingsOverride settings;
  std::map<std::string, std::string> more;  // options that only some makes have

  /// The command must outlive this.
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
