// Commands that query or control a running daemon over one connection to its control stream. Results go to standard output.
#pragma once

#include <cstdint>
#include <string>

#include "clients/sonarctl/control_client.hpp"

namespace sonar::clients {

struct StatusOptions {
  ControlOptions control;
  bool json = false;   // one object per line
  bool watch = false;  // repeat every second, until interrupted
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

/// Sends a request, and prints `done` if it succeeds.
Result<void> steer(const ControlOptions& control, ControlClient::Operation operation, const std::string& done);

struct StepOptions {
  ControlOptions control;
  double dt_s = 0;
  std::uint64_t count = 1;
  bool json = false;
};
/// Steps the time `count` times, or until interrupted; prints the time after each step and the number of its pings.
Result<void> step_time(const StepOptions& options);

/// Returns the path to send. If daemon and file are on this computer, it is absolute, for a daemon with another working
/// directory.
std::string scene_path_for(const Endpoint& daemon, const std::string& path);
Result<void> load_scene(const ControlOptions& control, const std::string& path);

Result<void> list_objects(const ControlOptions& control);

}  // namespace sonar::clients
