// Reads and validates a scene file (YAML, docs/scenes.md) and the files that it names.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "core/base/geodesy.hpp"
#include "core/base/result.hpp"
#include "core/scene/scene.hpp"

namespace sonar {
class ShapeCache;
namespace text {
class Map;
}

/// Reads a scene. Errors: "file:line:col: key.path: what is wrong", and the nearest valid name. `world_origin`: the position of
/// x = y = 0, for height grids in degrees and UTM that do not state an origin.
Result<std::shared_ptr<const Scene>> load_scene(const std::filesystem::path& file,
                                                const std::optional<Geodetic>& world_origin = {});
/// Parses the text of a scene. Errors begin with `name`; paths in the scene are relative to `folder`.
Result<std::shared_ptr<const Scene>> parse_scene(std::string_view text, const std::string& name,
                                                 const std::filesystem::path& folder);
/// Returns one of built_in_scenes (core/scene/files/built_in_scenes.hpp). Reads no files.
Result<std::shared_ptr<const Scene>> load_built_in_scene(std::string_view name);

/// Reads a scene from a map of a larger document, whose finish() then returns the errors. The result is never null. `known`:
/// shapes of scenes that were read earlier.
std::shared_ptr<const Scene> read_scene(text::Map map, const std::filesystem::path& folder, const std::string& name,
                                        ShapeCache* known = nullptr);

}  // namespace sonar
