// Converts magnitudes to colours: the maps, their files, the mapping, and pictures on disk.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "clients/bvtsdk/core/imaging.hpp"

namespace sonar::bvt {

inline constexpr int colour_map_entries = 4096;
inline constexpr std::array<std::string_view, 6> colour_map_names{"jet", "bone", "hot", "copper", "cool", "green"};

struct Colour {
  std::uint8_t blue = 0, green = 0, red = 0;
};
using ColourMap = std::vector<Colour>;  // 4096 entries, the weakest first; empty = none loaded

/// Computes the map of that name, one of colour_map_names; returns an empty map for other names.
ColourMap make_colour_map(std::string_view name);
/// Reads a raw file without a header: 4096 x B, G, R (verified on public files). Returns file_open if it cannot be opened, and
/// the code load_color_map if it has another size.
Code load_colour_map(const std::string& path, ColourMap& map);
Code save_colour_map(const std::string& path, const ColourMap& map);

/// Order of the bytes of a colour pixel in memory. Clients hand the pixels to OpenCV as BGRA (inferred).
enum class PixelOrder { bgra, rgba };
/// Reads the environment variable BVE_PIXEL (bgra or rgba); the default is bgra.
PixelOrder pixel_order_from_environment();

struct ColourImage : ImageGeometry {
  PixelOrder order = PixelOrder::bgra;
  std::vector<std::uint32_t> pixels;  // four bytes in memory in that order, alpha 255
};

/// The map entry for magnitude v is 4095 * clamp((v - bottom) / (top - bottom), 0, 1)^(1 / gamma), rounded. The formula is our
/// assumption.
class ColourMapper {
 public:
  explicit ColourMapper(PixelOrder order = pixel_order_from_environment()) : order_(order) {}

  /// Returns the codes of load_colour_map. If loading fails, the map in use is kept.
  Code load(const std::string& path);
  void use(ColourMap map);

  /// Returns bad_parameter unless 0 <= bottom < top <= 65535, and always in auto mode (verified: the SDK refuses it).
  Code set_thresholds(int top, int bottom);
  /// Returns bad_parameter unless 0 < gamma <= 100.
  Code set_gamma(float gamma);
  /// In auto mode, top is the larger of lowest_auto_top and the 99.5th percentile of the non-zero pixels (our assumption).
  void set_auto_mode(bool on);
  int top() const { return top_; }  // in auto mode: the top of the last image
  int bottom() const { return bottom_; }
  float gamma() const { return gamma_; }
  bool auto_mode() const { return auto_mode_; }

  /// Returns bad_color_map if no map is loaded, and memory_alloc if memory runs out.
  Code map(const MagImage& magnitudes, ColourImage& colours);

  static constexpr int lowest_auto_top = 4096;

 private:
  void build_table();

  PixelOrder order_;
  ColourMap map_;
  int top_ = 65535, bottom_ = 0;
  float gamma_ = 1;
  bool auto_mode_ = false;
  std::vector<std::uint32_t> table_;  // a pixel for each magnitude; empty = not built yet
};

/// Writes a P5 file of 16 bits, big-endian. Returns file_create if it cannot be created, and file_write if writing fails.
Code save_pgm(const std::string& path, const MagImage& image);
/// Writes a P6 file with 8 bits per channel.
Code save_ppm(const std::string& path, const ColourImage& image);

}  // namespace sonar::bvt
