// Addresses of models on Fuel servers, the model library of Gazebo. Text alone; nothing is fetched.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace sonar::scene_tools {

/// HOST/1.0/OWNER/models/NAME, then perhaps VERSION or tip, and files/ with a path in the model.
struct FuelAddress {
  std::string host, owner, name, version;
  std::vector<std::string> inside;  // the path
};
/// `address` without its scheme and escapes; also as web pages write it (app.gazebosim.org/OWNER/fuel/models/NAME).
std::optional<FuelAddress> fuel_address(std::string_view address);

/// The number that is the whole text; -1 for other texts.
int version_number(std::string_view text);

/// The name of a model in small letters: "coast water" for ".../models/Coast%20Water/2".
std::string model_name(std::string_view uri);

/// The shell command that fetches the model of this address, or the model with the file of this address. Empty for addresses
/// without a server, and for those that a shell could read as something else.
std::string fetch_command(std::string_view uri);

}  // namespace sonar::scene_tools
