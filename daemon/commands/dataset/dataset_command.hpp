// `sonard dataset`: a labelled data set from one job file. docs/datasets.md is its manual.
#pragma once

#include "daemon/commands/options/command_line.hpp"

namespace sonar::dataset {

/// The exit code. Errors: what the job, the options or the folder have wrong.
Result<int> run_dataset(const DatasetCommand& command);

}  // namespace sonar::dataset
