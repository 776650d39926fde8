// `sonard run`: reads the configuration, loads the scene, builds the engine and runs the App.
#pragma once

#include <chrono>

#include "daemon/commands/options/command_line.hpp"

namespace sonar {

/// Serves until stopped; returns the exit code. `begin`: start of the program, for the ready line. `json` is set to the format of
/// errors, which is that of the log once that is known.
Result<int> run_daemon(const RunCommand& command, std::chrono::steady_clock::time_point begin, bool& json);

}  // namespace sonar
