// `sonarctl farm`, which runs `sonard farm`: puts jobs into the farm's queue, shows their progress, and makes the data set of
// finished shards.
#pragma once

#include "daemon/commands/farm/queue.hpp"
#include "daemon/commands/options/command_line.hpp"

namespace sonar::farm {

/// The exit code. Errors: what the job or the folder have wrong; unavailable: the server; bad_data: shards that are missing or
/// differ from their digests.
Result<int> run_farm(const FarmCommand& command);
/// Jobs, their dead shards and their workers, in lines.
Result<std::string> describe_farm(Queue& queue);

}  // namespace sonar::farm
