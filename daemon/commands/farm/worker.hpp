// `sonard worker`: makes shards of a farm's jobs, one after the other, for as long as it runs. docs/datasets.md, "A farm".
#pragma once

#include "daemon/commands/command_line.hpp"

namespace sonar::farm {

/// The exit code. Errors: unavailable when no server answers at the start, or all jobs are unfit for this program or processor;
/// io when the folder cannot be written.
Result<int> run_worker(const WorkerCommand& command);

}  // namespace sonar::farm
