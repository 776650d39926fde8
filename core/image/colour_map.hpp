// Colours for sample values. A map has a few anchor colours and is linear between them.
// draw_fan uses them; users choose a map by its name.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.hpp"

namespace sonar {

struct Rgb {
  std::uint8_t r = 0, g = 0, b = 0;
  bool operator==(const Rgb&) const = default;
};

struct ColourMap {
  struct Anchor {
    float at = 0;  // position in the map; the anchors rise from 0 to 1
    float r = 0, g = 0, b = 0;
  };
  std::string_view name;
  std::vector<Anchor> anchors;

  /// Values outside 0..1 get the colour at the nearer end; NaN gets the first colour.
  Rgb colour(float value) const;
};

std::span<const ColourMap> colour_maps();
std::string colour_map_names();  // "gray, copper, ..."
/// Returns the colour map of this name. The error lists the valid names.
Result<ColourMap> find_colour_map(std::string_view name);

}  // namespace sonar
