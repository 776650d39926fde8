// `sonard worker`: makes shards of a farm's jobs, one after the other, for as long as it runs. docs/datasets.md, "A farm".
#pragma once

#include "daemon/commands/farm/queue.hpp"
#include "daemon/commands/options/command_line.hpp"

namespace sonar::farm {

/// Waits for a server that does not answer yet. Returns the exit code. Errors: unavailable if the server refuses, or if all jobs
/// are unfit for this program or processor; io if the folder cannot be written.
Result<int> run_worker(const WorkerCommand& command);
/// Works on a queue until a signal or, if requested, until the queue is empty.
Result<int> work_on(Queue& queue, const WorkerCommand& command);

}  // namespace sonar::farm
