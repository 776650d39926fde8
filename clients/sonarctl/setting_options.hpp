// Options for the source of pings and the settings of the sonar. They are the same for every make and for every command that
// shows or records pings.
#pragma once

#include <CLI/App.hpp>
#include <map>
#include <string>

#include "clients/sonarctl/argument_checks.hpp"
#include "clients/sonarctl/commands.hpp"

namespace sonar::clients {

struct SettingArguments {
  protocol::SettingsOverride settings;
  std::map<std::string, std::string> more;  // options of few makes

  /// The command must outlive this.
  void add_to(CLI::App& app);
  /// Returns the options that the user gave.
  protocol::Wanted wanted() const;
};

/// finish() turns the texts into a SourceOptions once the line is parsed.
struct SourceArguments {
  DeviceArguments device;
  bool as_it_is = false, observe = false;
  std::string make, control, sonar;
  std::filesystem::path token_file, recording;
  SettingArguments settings;

  /// `recordings`: adds --from, which reads a recording instead of a sonar. `control_help`: what --control's help says about the
  /// daemon.
  void add_to(CLI::App& app, bool recordings, const std::string& control_help = "reports the address for observers");
  Result<SourceOptions> finish() const;
};

}  // namespace sonar::clients
