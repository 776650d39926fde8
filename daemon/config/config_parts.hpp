// Readers of the parts that configurations and render files share: poses, water, options of a sonar, switches of the engine.
// They use strict_yaml cursors; the document's finish() returns errors.
#pragma once

#include <filesystem>

#include "core/text/strict_yaml.hpp"
#include "daemon/config/config.hpp"

namespace sonar {

/// Reads one of an enum's names, which are in the order of its values.
template <class Enum, std::size_t n>
Enum read_enum(const text::Node& node, Enum fallback, const std::array<std::string_view, n>& names) {
  return node.present() ? static_cast<Enum>(node.choice_index({names.begin(), names.end()})) : fallback;
}
/// `{frame: ENU_FLU | NED_FRD, xyz_m, rpy_deg}`; absent = the origin.
Pose read_world_pose(const text::Node& node);
/// `{frame: FLU | FRD, xyz_m, rpy_deg}` of a sonar on its vehicle.
Pose read_mount(const text::Node& node);
/// "127.0.0.1:14770" of a listener, at an address that a computer can have; the port of a destination may be missing.
Endpoint read_endpoint(const text::Node& node, bool is_listener);
/// `{lat, lon, alt}` of the world's origin; nullopt if absent.
std::optional<Geodetic> read_origin(const text::Node& node);
/// One endpoint, or a list of links. `has_ranges`: poses.allow_from is given.
std::vector<MavlinkConfig> read_mavlink(const text::Node& node, bool has_ranges, const Config& config);
/// Also checks whether the sonars can have the faults of the plan.
FaultConfig read_faults(const text::Node& node, const std::vector<SonarConfig>& sonars, const std::filesystem::path& directory);
/// Relative file names start at `directory`.
ControlConfig read_control(const text::Node& node, const std::filesystem::path& directory);
/// The name of a scene file, found as find_scene() does.
SceneFile read_scene_file(const text::Node& node, const std::filesystem::path& directory);
/// `allow_hot` is set to whether water of 30 C or more is accepted.
Water read_water(const text::Node& node, bool* allow_hot = nullptr);
/// Checks water from another source than a file by the same rules. Returns one sentence, or an empty text if it is valid.
std::string why_no_water(const Water& water, bool allow_hot);
/// Reads options and adds defaults. `others_too`: options that only other vendors have are checked and kept (products.hpp
/// reports them).
protocol::OptionValues read_options(const text::Node& node, const protocol::Vendor& vendor, bool others_too = false);
EngineConfig read_engine(const text::Node& node, const Switches& defaults = product_switches);
LimitConfig read_limits(const text::Node& node);

}  // namespace sonar
