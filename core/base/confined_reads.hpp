// Limits which files a program can read while it loads files of unknown origin, because such files can refer to any file of
// this computer.
#pragma once

#include <filesystem>

namespace sonar {

/// After this call, open_regular() opens only files whose real path is below `folder`. Call it once, before threads start.
void confine_reads(const std::filesystem::path& folder);
/// The folder passed to confine_reads(); empty if every file may be read.
const std::filesystem::path& readable_folder();

}  // namespace sonar
