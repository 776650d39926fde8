// Turns a ping's rows and beams into the fan an operator knows: sonar at the bottom, range upwards, port on the left.
// Uses the beams' own directions, and averages over each pixel's footprint, so that nothing flickers or is skipped.
#pragma once

#include <string>
#include <vector>

#include "core/base/result.hpp"
#include "core/image/colour_map.hpp"
#include "core/image/polar_image.hpp"
#include "core/image/raster.hpp"

namespace sonar {

inline constexpr Rgb outside_colour{13, 17, 23}, ring_colour{150, 160, 170}, label_colour{190, 198, 206};  // used in all pictures

struct FanStyle {
  int width_px = 1000;  // 64..8000
  ColourMap colours;
  bool rings = true;  // range rings with their metres
};

/// Where the picture's metres lie among its pixels: the sonar is at (apex_x, apex_y), y grows downwards.
struct FanLayout {
  int width = 0, height = 0;
  double apex_x = 0, apex_y = 0, metres_per_pixel = 1;
};
/// Layout of the fan of an image that draw_fan does not refuse.
FanLayout fan_layout(const PolarImage& image, const FanStyle& style);

/// Refuses an image without rows or beams, or with a bearing table that does not run from port to starboard within a circle.
Result<Raster> draw_fan(const PolarImage& image, const FanStyle& style);

/// Draws one ping after another as draw_fan does, in a third of the time: where the footprint of each pixel lies is kept until
/// rows, beams or bearings change. 32 bytes a pixel.
class FanPainter {
 public:
  explicit FanPainter(FanStyle style) : style_(std::move(style)) {}
  Result<Raster> draw(const PolarImage& image);

 private:
  /// Units are rows and beams; cell i is [i, i + 1).
  struct Footprint {
    double row_low = 0, row_high = -1, beam_low = 0, beam_high = 0;
    bool is_outside() const { return row_high < row_low; }
  };
  bool fits(const PolarImage& image) const;
  void lay_out(const PolarImage& image);
  static Footprint footprint(const PolarImage& image, double x_m, double y_m, double pixel_m);
  static float mean(const PolarImage& image, const Footprint& of);

  FanStyle style_;
  PolarImage shape_;  // shape of the images for which footprints_ were made; without samples
  FanLayout layout_;
  std::vector<Footprint> footprints_;  // [height][width]
};

/// Distance between range rings: 1, 2 or 5 times a power of ten, four to ten rings.
double ring_spacing_m(double range_m);

}  // namespace sonar
