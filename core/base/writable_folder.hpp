// Checks, without writing, whether files can be created in a folder that a user named.
#pragma once

#include <filesystem>
#include <string>

namespace sonar {

/// The reason why files cannot be created there, for an error after the folder's name: "is not a folder". Empty = they can be.
std::string why_no_files_in(const std::filesystem::path& folder);

}  // namespace sonar
