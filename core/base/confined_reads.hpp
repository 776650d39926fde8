// Confines the reads of programs that load files of unknown origin, so that names in them cannot lead to other files of this
// computer.
#pragma once

#include <filesystem>

namespace sonar {

/// From now on open_regular() opens only what is below `folder`, links followed. Call it once, before there are threads.
void confine_reads(const std::filesystem::path& folder);
/// That folder; empty when everything may be read.
const std::filesystem::path& readable_folder();

}  // namespace sonar
