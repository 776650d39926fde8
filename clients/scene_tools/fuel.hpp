// Addresses of models on Fuel servers, the model library of Gazebo. These functions only parse text and fetch nothing.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace sonar::scene_tools {

/// The address HOST/1.0/OWNER/models/NAME, optionally with VERSION or `tip` and with files/ and a path in the model.
struct FuelAddress {
  std::string host, owner, name, version;
  std::vector<std::string> inside;  // the path
};
/// Parses an address without scheme and escapes, also in the form of web pages (app.gazebosim.org/OWNER/fuel/models/NAME).
std::optional<FuelAddress> fuel_address(std::string_view address);

/// Returns the number that the whole text is, or -1.
int version_number(std::string_view text);

/// Returns the name of a model in small letters: "coast water" for ".../models/Coast%20Water/2".
std::string model_name(std::string_view uri);

/// The shell command that fetches the model of this address, or the model with the file of this address. Empty for addresses
/// without a server, and for those that a shell could read as something else.
std::string fetch_command(std::string_view uri);

}  // namespace sonar::scene_tools
