// `sonarctl farm`, which runs `sonard farm`: puts jobs into the farm's queue, shows their progress, and makes the data set of
// finished shards.
#pragma once

#include "daemon/commands/farm/queue.hpp"
#include "daemon/commands/options/command_line.hpp"

namespace sonar::farm {

/// Returns the exit code. Errors: faults of the job or the folder; unavailable (the server); bad_data if shards are missing or
/// differ from their digests.
Result<int> run_farm(const FarmCommand& command);
/// Returns lines about the jobs, their dead shards and their workers.
Result<std::string> describe_farm(Queue& queue);

}  // namespace sonar::farm
