// Checks whether files can be made in a folder that a user named, without making one.
#pragma once

#include <filesystem>
#include <string>

namespace sonar {

/// The reason why not, to follow the folder's name in an error: "is not a folder"; empty = files can be made.
std::string why_no_files_in(const std::filesystem::path& folder);

}  // namespace sonar
