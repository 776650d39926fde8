// For each command, a function that adds its options to the parser and returns the function that executes it. run() lists them.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "core/base/result.hpp"

namespace CLI {
class App;
}

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

}  // namespace sonar::clients
