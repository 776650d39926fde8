// Finds files referenced by Gazebo and URDF files on this disk: model://, package://, file://, plain paths, and addresses of a
// Fuel server in the caches of both generations of Gazebo.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "clients/scene_tools/imported_world.hpp"

namespace sonar::scene_tools {

/// Folders to search, in this order: `given`, then those of GZ_SIM_RESOURCE_PATH, GAZEBO_MODEL_PATH, IGN_GAZEBO_RESOURCE_PATH
/// and, for packages, ROS_PACKAGE_PATH; last ~/.gazebo/models.
std::vector<std::filesystem::path> resource_folders(const std::vector<std::filesystem::path>& given);

/// Finds the file that `uri` names in `from_file`; returns an empty path if there is none. It searches the folders, the folder
/// of `from_file`, and up to eight levels above it. For a Fuel address it first searches GZ_FUEL_CACHE_PATH,
/// IGN_FUEL_CACHE_PATH, ~/.gz/fuel and ~/.ignition/fuel. For a folder it returns the SDF that model.config names, or model.sdf,
/// of the newest version.
std::filesystem::path find_resource(std::string_view uri, const std::filesystem::path& from_file,
                                    const std::vector<std::filesystem::path>& folders);

/// Reads at most max_xml_bytes of a file.
Result<std::string> read_text(const std::filesystem::path& path);

/// File access for the readers.
Library library_on_disk(const std::vector<std::filesystem::path>& given);

}  // namespace sonar::scene_tools
