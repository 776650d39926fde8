// Readers of the parts that configurations and render files share: poses, water, options of a sonar, switches of the engine. The
// readers use nodes of core/text/strict_yaml; finish() of the document returns errors.
#pragma once

#include <filesystem>

#include "core/text/strict_yaml.hpp"
#include "daemon/config/config.hpp"

namespace sonar {

/// Reads a name of an enum; the names are in the order of the values.
template <class Enum, std::size_t n>
Enum read_enum(const text::Node& node, Enum fallback, const std::array<std::string_view, n>& names) {
  return node.present() ? static_cast<Enum>(node.choice_index({names.begin(), names.end()})) : fallback;
}
/// Reads `{frame: ENU_FLU | NED_FRD, xyz_m, rpy_deg}`; absent = the origin.
Pose read_world_pose(const text::Node& node);
/// Reads `{frame: FLU | FRD, xyz_m, rpy_deg}` of a sonar on its vehicle.
Pose read_mount(const text::Node& node);
/// Reads an endpoint such as "127.0.0.1:14770". A listener must have an address that a computer can have; the port of a
/// destination may be missing.
Endpoint read_endpoint(const text::Node& node, bool is_listener);
/// Reads `{lat, lon, alt}` of the world's origin; nullopt if absent.
std::optional<Geodetic> read_origin(const text::Node& node);
/// Reads `off`, one endpoint, or a list of links. `has_ranges`: poses.allow_from is given.
std::vector<MavlinkConfig> read_mavlink(const text::Node& node, bool has_ranges, const Config& config);
/// Reads the keys for faults, and checks whether the sonars can have the faults of the plan.
FaultConfig read_faults(const text::Node& node, const std::vector<SonarConfig>& sonars, const std::filesystem::path& directory);
/// Reads the control interfaces. Relative file names are relative to `directory`.
ControlConfig read_control(const text::Node& node, const std::filesystem::path& directory);
/// Reads the name of a scene file, and finds the file with find_scene().
SceneFile read_scene_file(const text::Node& node, const std::filesystem::path& directory);
/// Reads the water. Sets `allow_hot` to whether water of 30 C or more is accepted.
Water read_water(const text::Node& node, bool* allow_hot = nullptr);
/// Checks water that does not come from a file with the same rules. Returns one sentence; empty if the water is valid.
std::string why_no_water(const Water& water, bool allow_hot);
/// Reads options and adds defaults. `others_too`: also accepts options that only other vendors have (products.hpp reports them).
protocol::OptionValues read_options(const text::Node& node, const protocol::Vendor& vendor, bool others_too = false);
EngineConfig read_engine(const text::Node& node, const Switches& defaults = product_switches);
LimitConfig read_limits(const text::Node& node);

}  // namespace sonar
