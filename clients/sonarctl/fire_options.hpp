// The sonar's settings on the command line: trade units in, a fire message out.
// Used by every command that talks to a device.
#pragma once

#include <CLI/App.hpp>
#include <cstdint>
#include <map>
#include <string>

#include "clients/sonarctl/blueview_stream.hpp"
#include "protocol/oculus/fire.hpp"

namespace sonar::clients {

struct FireArguments {
  int mode = 2, beams = 512, bits = 8, gamma = 127, version = 0;
  double range_m = 10, range_percent = 0, gain_percent = 50, sound_speed_mps = 0, salinity_ppt = 0;
  std::string rate = "10";
  bool row_gains = false, gain_assist = false, trigger = false;
  const CLI::App* command = nullptr;  // the parsed command

  /// The command must outlive this.
  void add_to(CLI::App& app);
  oculus::FireRequest request() const;
  /// The same for a BlueView head: only the options that were typed.
  HeadRequest head_request() const;
  bool triggered() const { return trigger; }
};

}  // namespace sonar::clients
