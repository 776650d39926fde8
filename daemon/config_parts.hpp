// Parts that the configuration and the render files have in common: poses, water, options of a sonar, switches of the engine.
// Readers over strict_yaml cursors; what is wrong is told by the document's finish().
#pragma once

#include <filesystem>

#include "core/text/strict_yaml.hpp"
#include "daemon/config.hpp"

namespace sonar {

/// `{frame: ENU_FLU | NED_FRD, xyz_m, rpy_deg}`; absent = the origin.
Pose read_world_pose(const text::Node& node);
/// `{frame: FLU | FRD, xyz_m, rpy_deg}` of a sonar on its vehicle.
Pose read_mount(const text::Node& node);
/// The name of a scene file, found as find_scene() does.
SceneFile read_scene_file(const text::Node& node, const std::filesystem::path& directory);
Water read_water(const text::Node& node);
/// Complete: defaults filled in.
protocol::OptionValues read_options(const text::Node& node, const protocol::Vendor& vendor);
EngineConfig read_engine(const text::Node& node);
LimitConfig read_limits(const text::Node& node);

}  // namespace sonar
