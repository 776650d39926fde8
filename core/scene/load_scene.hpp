// Reads a scene file (YAML) and everything it names into a Scene, validated. The format is described in docs/scenes.md.
#pragma once

#include <filesystem>
#include <memory>
#include <string_view>

#include "core/base/result.hpp"
#include "core/scene/scene.hpp"

namespace sonar {

/// Errors: file:line:col: key.path: what, and the nearest valid name.
Result<std::shared_ptr<const Scene>> load_scene(const std::filesystem::path& file);

}  // namespace sonar
