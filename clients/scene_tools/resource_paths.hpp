// Finds files referenced by Gazebo and URDF files on this disk: model://, package://, file://, plain paths, and addresses of a
// Fuel server in the caches of both generations of Gazebo.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "clients/scene_tools/imported_world.hpp"

namespace sonar::scene_tools {

// Addresses of models on Fuel servers, the model library of Gazebo. These functions only parse text and fetch nothing.

/// The address HOST/1.0/OWNER/models/NAME, optionally with VERSION or `tip` and with files/ and a path in the model.
struct FuelAddress {
  std::string host, owner, name, version;
  std::vector<std::string> inside;  // the path
};
/// Parses an address without scheme and escapes, also in the form of web pages (app.gazebosim.org/OWNER/fuel/models/NAME).
std::optional<FuelAddress> fuel_address(std::string_view address);

/// Returns the number if the whole text is one, else -1.
int version_number(std::string_view text);

/// Returns the name in small letters, with a blank for "_". Names of models are compared in this form, because Gazebo stores
/// downloads in small letters, and repositories often name the folder of the model "Sand Bed" sand_bed.
std::string folded_name(std::string_view name);

/// Returns the name of a model in small letters: "coast water" for ".../models/Coast%20Water/2".
std::string model_name(std::string_view uri);

/// Returns the shell command that fetches the model of this address, or the model with the file of this address. Returns an empty
/// text for addresses without a server, and for those with characters that a shell could interpret.
std::string fetch_command(std::string_view uri);

/// Returns the folders to search, in this order: `given`, those of GZ_SIM_RESOURCE_PATH, GAZEBO_MODEL_PATH,
/// IGN_GAZEBO_RESOURCE_PATH, ROS_PACKAGE_PATH and AMENT_PREFIX_PATH, and ~/.gazebo/models.
std::vector<std::filesystem::path> resource_folders(const std::vector<std::filesystem::path>& given);

/// Finds the file that `uri` names in `from_file`; returns an empty path if there is none. It searches the folders, the folder
/// of `from_file`, and seven levels above it. For a Fuel address it first searches GZ_FUEL_CACHE_PATH,
/// IGN_FUEL_CACHE_PATH, ~/.gz/fuel and ~/.ignition/fuel. For a folder it returns the SDF that model.config names, or model.sdf,
/// of the newest version.
std::filesystem::path find_resource(std::string_view uri, const std::filesystem::path& from_file,
                                    const std::vector<std::filesystem::path>& folders);

/// Reads a file. Errors: more than max_xml_bytes, or not readable.
Result<std::string> read_text(const std::filesystem::path& path);

/// Returns the file access for the readers.
Library library_on_disk(const std::vector<std::filesystem::path>& given);

}  // namespace sonar::scene_tools
