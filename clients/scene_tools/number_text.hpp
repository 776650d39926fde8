// Numbers, lengths and sizes of a scene as text. Internal to the scene tools.
#pragma once

#include <cstddef>
#include <string>

#include "core/base/geometry.hpp"

namespace sonar::scene_tools {

/// 139000 -> "139 000"
std::string grouped(std::size_t number);
/// Three significant digits: "12.3 m", "4.5 mm".
std::string length_text(double length_m);
/// "12.3 x 4 x 0.5"
std::string size_text(Vec3d size_m);
/// "(1, -2.5, 0)"
std::string place_text(Vec3d place_m);
/// "3.2 MB"
std::string bytes_text(std::size_t bytes);

}  // namespace sonar::scene_tools
