// The commands of sonard. Each has its own file. docs/render.md and docs/datasets.md are the manuals of `render`, `dataset`,
// `farm` and `worker`. Errors name the input, the options and the folders that the user gave.
#pragma once

#include <chrono>

#include "daemon/commands/options/command_line.hpp"

namespace sonar {

/// Validates a configuration and its scene, and prints its content and probable mistakes. Errors: those of the configuration,
/// the control token and the scene.
Result<void> run_check(const CheckCommand& command);
/// Reads the configuration, loads the scene, builds the engine, and runs the App until stopped. Returns the exit code. `begin`:
/// start of the program, for the ready line. `json` is set if errors must be JSON, as soon as the format of the log is known.
Result<int> run_daemon(const RunCommand& command, std::chrono::steady_clock::time_point begin, bool& json);

namespace render {
/// Renders pings into files, or reports coverage.
Result<void> run_render(const RenderCommand& command);
}  // namespace render

namespace dataset {
/// Makes a labelled data set from one job file. Returns the exit code.
Result<int> run_dataset(const DatasetCommand& command);
}  // namespace dataset

namespace farm {
class Queue;

/// Puts jobs into the farm's queue, shows their progress, and makes the data set of finished shards; `sonarctl farm` calls it.
/// Returns the exit code. Errors include unavailable if the server does not answer, and bad_data if shards are missing or differ
/// from their digests.
Result<int> run_farm(const FarmCommand& command);
/// Returns lines about the jobs, their dead shards and their workers.
Result<std::string> describe_farm(Queue& queue);

/// Makes shards of a farm's jobs, one after the other, until it is stopped. Waits for a server that does not answer yet. Returns
/// the exit code. Errors: unavailable if the server refuses, or if all jobs are unfit for this program or processor; io if the
/// folder cannot be written.
Result<int> run_worker(const WorkerCommand& command);
/// Works on a queue until a signal or, if requested, until the queue is empty.
Result<int> work_on(Queue& queue, const WorkerCommand& command);
}  // namespace farm

}  // namespace sonar
