// The sonar's settings on the command line, the same for every make. Used by every command that talks to a device.
#pragma once

#include <CLI/App.hpp>
#include <map>
#include <string>

#include "protocol/host.hpp"

namespace sonar::clients {

struct SettingArguments {
  protocol::SettingsOverride settings;
  std::map<std::string, std::string> more;  // options that few makes have

  /// The command must outlive this.
  void add_to(CLI::App& app);
  /// The options that were typed.
  protocol::Wanted wanted() const;
};

}  // namespace sonar::clients
