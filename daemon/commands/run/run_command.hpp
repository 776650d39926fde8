// `sonard run`: reads the configuration, loads the scene, builds the engine and runs the App.
#pragma once

#include <chrono>

#include "daemon/commands/options/command_line.hpp"

namespace sonar {

/// Serves until stopped; returns the exit code. `begin` = of the program, for the ready line. `json` is set to how errors are
/// written: as the log is, as far as that is known by then.
Result<int> run_daemon(const RunCommand& command, std::chrono::steady_clock::time_point begin, bool& json);

}  // namespace sonar
