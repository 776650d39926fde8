// `sonarctl record`: records the vendor's messages as a client of the sonar, or converts a recording.
#pragma once

#include "clients/sonarctl/record_options.hpp"
#include "core/base/result.hpp"

namespace sonar::clients {

/// Succeeds at its limits, on Ctrl-C and at the end of a recording. After an error, too, the files contain everything so far.
Result<void> record(const RecordOptions& options);

}  // namespace sonar::clients
