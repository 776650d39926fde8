// Suggests the closest scene name that find_scene() would find, for errors of configurations and render files.
#pragma once

#include <filesystem>
#include <string>

namespace sonar {

/// Returns a similar name that find_scene() finds in `directory`; empty if there is none.
std::string nearest_scene(const std::filesystem::path& given, const std::filesystem::path& directory);

}  // namespace sonar
