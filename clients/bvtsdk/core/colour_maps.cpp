#include "clients/bvtsdk/core/colour_maps.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <new>

namespace sonar::bvt {
namespace {

struct Rgb {
  double red, green, blue;
};

double ramp(double t) { return std::clamp(t, 0.0, 1.0); }

Rgb hot(double t) { return {ramp(t * 8 / 3), ramp((t - 0.375) * 8 / 3), ramp((t - 0.75) * 4)}; }

/// Computes a colour with the usual formula of the palette; t is 0 for the weakest echo and 1 for the strongest.
Rgb colour_at(std::string_view name, double t) {
  if (name == "jet") return {ramp(1.5 - std::abs(4 * t - 3)), ramp(1.5 - std::abs(4 * t - 2)), ramp(1.5 - std::abs(4 * t - 1))};
  if (name == "bone") {  // grey, with an eighth of the map `hot` in reverse order of colours
    const Rgb h = hot(t);
    return {(7 * t + h.blue) / 8, (7 * t + h.green) / 8, (7 * t + h.red) / 8};
  }
  if (name == "hot") return hot(t);
  if (name == "copper") return {ramp(1.25 * t), 0.7812 * t, 0.4975 * t};
  if (name == "cool") return {t, 1 - t, 1};
  return {0, t, 0};  // green
}

std::uint8_t byte_of(double x) { return static_cast<std::uint8_t>(std::lround(255 * x)); }

std::uint32_t pixel_of(const Colour& c, PixelOrder order) {
  const std::uint8_t bgra[4] = {c.blue, c.green, c.red, 255}, rgba[4] = {c.red, c.green, c.blue, 255};
  std::uint32_t pixel;
  std::memcpy(&pixel, order == PixelOrder::bgra ? bgra : rgba, sizeof pixel);
  return pixel;
}

/// Returns the smallest magnitude that 99.5 % of the pixels do not exceed. Pixels of 0 (outside the sector, or no echo) do not
/// count.
int high_percentile(const MagImage& image) {
  std::vector<std::uint32_t> histogram(65536, 0);
  for (const std::uint16_t v : image.pixels) ++histogram[v];
  const std::size_t nonzero = image.pixels.size() - histogram[0];
  const auto wanted = static_cast<std::size_t>(std::ceil(0.995 * static_cast<double>(nonzero)));
  std::size_t below = 0;
  for (std::size_t v = 1; v < histogram.size(); ++v)
    if ((below += histogram[v]) >= wanted) return static_cast<int>(v);
  return 65535;
}

}  // namespace

ColourMap make_colour_map(std::string_view name) {
  ColourMap map;
  if (std::find(colour_map_names.begin(), colour_map_names.end(), name) == colour_map_names.end()) return map;
  for (int i = 0; i < colour_map_entries; ++i) {
    const Rgb c = colour_at(name, i / (colour_map_entries - 1.0));
    map.push_back({byte_of(c.blue), byte_of(c.green), byte_of(c.red)});
  }
  return map;
}

PixelOrder pixel_order_from_environment() {
  const char* const order = std::getenv("BVE_PIXEL");
  return order && std::strcmp(order, "rgba") == 0 ? PixelOrder::rgba : PixelOrder::bgra;
}

Code ColourMapper::load(const std::string& path) {
  ColourMap map;
  const Code code = load_colour_map(path, map);
  if (code == success) use(std::move(map));
  return code;
}

void ColourMapper::use(ColourMap map) {
  map_ = std::move(map);
  table_.clear();
}

Code ColourMapper::set_thresholds(int top, int bottom) {
  if (auto_mode_ || bottom < 0 || top > 65535 || bottom >= top) return bad_parameter;
  top_ = top;
  bottom_ = bottom;
  table_.clear();
  return success;
}

Code ColourMapper::set_gamma(float gamma) {
  if (!(gamma > 0 && gamma <= 100)) return bad_parameter;
  gamma_ = gamma;
  table_.clear();
  return success;
}

void ColourMapper::set_auto_mode(bool on) { auto_mode_ = on; }

void ColourMapper::build_table() {
  std::array<std::uint32_t, colour_map_entries> pixels;
  for (std::size_t i = 0; i < pixels.size(); ++i) pixels[i] = pixel_of(map_[i], order_);
  std::vector<std::uint32_t> table(65536);
  const double span = top_ - bottom_, power = 1 / static_cast<double>(gamma_);
  for (int v = 0; v < 65536; ++v) {
    const double t = ramp((v - bottom_) / span);
    const double bent = gamma_ == 1 || t <= 0 || t >= 1 ? t : std::pow(t, power);
    table[static_cast<std::size_t>(v)] = pixels[static_cast<std::size_t>(std::lround((colour_map_entries - 1) * bent))];
  }
  table_ = std::move(table);
}

Code ColourMapper::map(const MagImage& magnitudes, ColourImage& colours) {
  colours = {};
  if (map_.size() != colour_map_entries) return bad_color_map;
  try {
    if (auto_mode_) {
      const int top = std::max({high_percentile(magnitudes), lowest_auto_top, bottom_ + 1});
      if (top != top_) table_.clear();
      top_ = top;
    }
    if (table_.empty()) build_table();
    colours.pixels.resize(magnitudes.pixels.size());
    const std::uint32_t* const table = table_.data();
    std::transform(magnitudes.pixels.begin(), magnitudes.pixels.end(), colours.pixels.begin(),
                   [table](std::uint16_t v) { return table[v]; });
  } catch (const std::bad_alloc&) {
    colours = {};
    return memory_alloc;
  }
  static_cast<ImageGeometry&>(colours) = magnitudes;
  colours.order = order_;
  return success;
}

}  // namespace sonar::bvt
