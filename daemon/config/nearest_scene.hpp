// What somebody may have meant who named a scene that is nowhere: the nearest name among those that find_scene() would find.
// Used by the readers of configurations and render files, for their refusal.
#pragma once

#include <filesystem>
#include <string>

namespace sonar {

/// A name that find_scene() finds in the same `directory`; empty when none is near.
std::string nearest_scene(const std::filesystem::path& given, const std::filesystem::path& directory);

}  // namespace sonar
