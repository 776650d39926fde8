// Checks whether files can be created in a folder that a user named. The check writes nothing.
#pragma once

#include <filesystem>
#include <string>

namespace sonar {

/// The reason why files cannot be created in the folder, such as "is not a folder". It follows the folder's name in an error.
/// Empty = files can be created.
std::string why_no_files_in(const std::filesystem::path& folder);

}  // namespace sonar
