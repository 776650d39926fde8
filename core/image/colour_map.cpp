#include "core/image/colour_map.hpp"

#include <algorithm>
#include <cmath>

namespace sonar {
namespace {

std::uint8_t byte_from(float unit) { return static_cast<std::uint8_t>(std::lround(std::clamp(unit, 0.0f, 1.0f) * 255.0f)); }

const std::vector<ColourMap>& all_maps() {
  static const std::vector<ColourMap> maps{
      {"gray", {{0, 0, 0, 0}, {1, 1, 1, 1}}},
      // Red rises fastest and saturates at four fifths, like the colour of light on copper.
      {"copper", {{0, 0, 0, 0}, {0.8f, 1, 0.62f, 0.4f}, {1, 1, 0.78f, 0.5f}}},
      // Colours of a black body: red rises first, then green, then blue.
      {"hot", {{0, 0, 0, 0}, {0.375f, 1, 0, 0}, {0.75f, 1, 1, 0}, {1, 1, 1, 1}}},
      {"amber", {{0, 0, 0, 0}, {0.3f, 0.35f, 0.16f, 0.02f}, {0.7f, 0.95f, 0.6f, 0.12f}, {1, 1, 0.97f, 0.8f}}},
      {"ocean", {{0, 0, 0.01f, 0.05f}, {0.3f, 0, 0.14f, 0.35f}, {0.65f, 0.05f, 0.55f, 0.65f}, {1, 0.95f, 1, 0.95f}}},
      // Perceptually uniform from dark violet to yellow, sampled in tenths (the viridis map, CC0).
      {"viridis",
       {{0.0f, 0.267f, 0.005f, 0.329f},
        {0.1f, 0.283f, 0.141f, 0.458f},
        {0.2f, 0.254f, 0.265f, 0.530f},
        {0.3f, 0.207f, 0.372f, 0.553f},
        {0.4f, 0.164f, 0.471f, 0.558f},
        {0.5f, 0.128f, 0.567f, 0.551f},
        {0.6f, 0.135f, 0.659f, 0.518f},
        {0.7f, 0.267f, 0.749f, 0.441f},
        {0.8f, 0.478f, 0.821f, 0.318f},
        {0.9f, 0.741f, 0.873f, 0.150f},
        {1.0f, 0.993f, 0.906f, 0.144f}}},
      // Looks the same to colour-blind people, from dark blue to yellow (the cividis map, CC0).
      {"cividis",
       {{0.0f, 0.000f, 0.133f, 0.306f},
        {0.111f, 0.071f, 0.208f, 0.439f},
        {0.222f, 0.231f, 0.286f, 0.424f},
        {0.333f, 0.341f, 0.365f, 0.427f},
        {0.444f, 0.439f, 0.443f, 0.451f},
        {0.556f, 0.541f, 0.525f, 0.471f},
        {0.667f, 0.647f, 0.612f, 0.455f},
        {0.778f, 0.765f, 0.702f, 0.412f},
        {0.889f, 0.882f, 0.800f, 0.333f},
        {1.0f, 0.996f, 0.910f, 0.220f}}},
  };
  return maps;
}

}  // namespace

Rgb ColourMap::colour(float value) const {
  const float x = value > 0 ? std::min(value, 1.0f) : 0.0f;
  const auto upper = std::find_if(anchors.begin() + 1, anchors.end() - 1, [x](const Anchor& a) { return x <= a.at; });
  const Anchor& b = *upper;
  const Anchor& a = *(upper - 1);
  const float t = (x - a.at) / (b.at - a.at);
  return {byte_from(a.r + t * (b.r - a.r)), byte_from(a.g + t * (b.g - a.g)), byte_from(a.b + t * (b.b - a.b))};
}

std::span<const ColourMap> colour_maps() { return all_maps(); }

std::string colour_map_names() {
  std::string names;
  for (const ColourMap& map : colour_maps()) names += (names.empty() ? "" : ", ") + std::string(map.name);
  return names;
}

Result<ColourMap> find_colour_map(std::string_view name) {
  for (const ColourMap& map : colour_maps())
    if (map.name == name) return map;
  return failure(ErrorKind::usage, "unknown colour map \"" + std::string(name) + "\"; choose one of " + colour_map_names());
}

}  // namespace sonar
