// sonarctl record: writes the vendor's bytes of a sonar into files, as its client, or converts a recording.
#pragma once

#include "clients/sonarctl/record_options.hpp"
#include "core/base/result.hpp"

namespace sonar::clients {

/// Succeeds at its limits, on Ctrl-C and at the end of a recording. In every case the files hold what was recorded.
Result<void> record(const RecordOptions& options);

}  // namespace sonar::clients
