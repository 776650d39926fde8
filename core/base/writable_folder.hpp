// Checks that files can be made in a folder that a user named; makes none.
#pragma once

#include <filesystem>
#include <string>

namespace sonar {

/// A reason, to stand behind the folder's name: "is read-only"; empty = they can be made.
std::string why_no_files_in(const std::filesystem::path& folder);

}  // namespace sonar
