// `sonard dataset`: makes a labelled data set from one job file (docs/datasets.md).
#pragma once

#include "daemon/commands/options/command_line.hpp"

namespace sonar::dataset {

/// Returns the exit code. Errors: faults of the job, the options or the folder.
Result<int> run_dataset(const DatasetCommand& command);

}  // namespace sonar::dataset
