// Asking and steering a running daemon: what each command does with one conversation on the control stream. The command line
// fills the options; results go to standard output.
#pragma once

#include <cstdint>
#include <string>

#include "clients/sonarctl/control/control_client.hpp"

namespace sonar::clients {

struct StatusOptions {
  ControlOptions control;
  bool json = false;   // one object a line
  bool watch = false;  // again every second, until interrupted
  double period_s = 1;
};
Result<void> print_status(const StatusOptions& options);

struct EventsOptions {
  ControlOptions control;
  control::Subscribe wanted;
  bool json = false;
  std::uint64_t count = 0;  // 0 = no limit
  double seconds = 0;       // 0 = no limit
};
Result<void> print_events(const EventsOptions& options);

/// One request and what to say when it was done.
Result<void> steer(const ControlOptions& control, ControlClient::Operation operation, const std::string& done);

struct StepOptions {
  ControlOptions control;
  double dt_s = 0;
  std::uint64_t count = 1;
  bool json = false;
};
/// Step by step, until interrupted; a line says what time it is then, and how many pings came of it.
Result<void> step_time(const StepOptions& options);

/// The path as the daemon will find it: a file that exists here is named in full, since the daemon has another folder.
std::string scene_path_for(const Endpoint& daemon, const std::string& path);
Result<void> load_scene(const ControlOptions& control, const std::string& path);

Result<void> list_objects(const ControlOptions& control);

}  // namespace sonar::clients
