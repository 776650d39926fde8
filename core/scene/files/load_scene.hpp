// Reads and validates a scene file (YAML, docs/scenes.md) and the files that it names.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "core/base/geodesy.hpp"
#include "core/base/result.hpp"
#include "core/scene/files/shapes.hpp"
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

// The objects of a scene file: shapes with poses, instances, moving bodies, point targets. Only the scene loader uses this.

inline constexpr std::size_t max_objects = 20000;
inline constexpr std::size_t max_bodies = 256;

/// Reads `pose: {xyz_m: [..], rpy_deg: [..]}`. Missing keys mean zero.
Pose read_pose(const text::Node& node);
/// Reads the list of objects into the scene. Objects and bodies keep the order of the file.
void read_objects(const text::Node& list, ShapeReader& shapes);
/// Reads `other_sonars: [{name, xyz_m, level_db, rate_hz, pulse_ms}]`.
void read_other_sonars(const text::Node& list, Scene& scene);
/// Reads `sea_surface: {size_m, centre_m, lambert_db, roughness_m, bubble_layer_m, bubble_loss_db_per_m}`: a sheet at z = 0.
void read_sea_surface(const text::Node& node, ShapeReader& shapes);
/// Reads `water_column: {volume_db}` or `{clarity: clear | turbid}`: scatterers in the water.
void read_water_column(const text::Node& node, Scene& scene);

}  // namespace sonar
