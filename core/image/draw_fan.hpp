// Draws the rows and beams of a ping as a fan: the sonar is at the bottom, range increases upwards, port is on the left. For a
// sonar that looks down, the sonar is at the top. The direction of each beam is used. Each pixel is the average over its
// footprint, so that no sample is skipped.
#pragma once

#include <cmath>
#include <functional>
#include <vector>

#include "core/base/result.hpp"
#include "core/image/colour_map.hpp"
#include "core/image/raster.hpp"
#include "core/image/sonar_picture.hpp"

namespace sonar {

inline constexpr Rgb outside_colour{13, 17, 23}, ring_colour{150, 160, 170}, label_colour{190, 198, 206};  // used in all pictures

struct FanStyle {
  int width_px = 1000;  // 64..8000
  ColourMap colours;
  bool rings = true;  // range rings and their ranges in metres
};

enum class Opens { upwards, downwards };  // direction of increasing range

/// Relation between metres and pixels: the sonar is at (apex_x, apex_y), and y increases downwards.
struct FanLayout {
  int width = 0, height = 0;
  double apex_x = 0, apex_y = 0, metres_per_pixel = 1;
  double up = 1;  // -1: the fan opens downwards

  double x_of(double azimuth, double range_m) const { return apex_x - range_m / metres_per_pixel * std::sin(azimuth); }
  double y_of(double azimuth, double range_m) const { return apex_y - up * range_m / metres_per_pixel * std::cos(azimuth); }
};
/// The layout of the fan for an image that draw_fan accepts.
FanLayout fan_layout(const PolarImage& image, const FanStyle& style, Opens opens = Opens::upwards);

/// Draws the image. Returns an error if it has no rows or beams, if its bearings do not decrease from port to starboard, or if
/// they span more than a circle.
Result<Raster> draw_fan(const PolarImage& image, const FanStyle& style);

/// Draws a series of pings like draw_fan, but three times as fast. It reuses the footprints of the pixels until the ranges of
/// the rows, the bearings of the beams or the direction change. It needs 32 bytes per pixel.
class FanPainter {
 public:
  explicit FanPainter(FanStyle style) : style_(std::move(style)) {}
  Result<Raster> draw(const PolarImage& image, Opens opens = Opens::upwards);

 private:
  /// The area of a pixel in units of rows and beams; row or beam i is [i, i + 1).
  struct Footprint {
    double row_low = 0, row_high = -1, beam_low = 0, beam_high = 0;
    bool is_outside() const { return row_high < row_low; }
  };
  bool fits(const PolarImage& image, Opens opens) const;
  void lay_out(const PolarImage& image, Opens opens);
  static Footprint footprint(const PolarImage& image, double x_m, double y_m, double pixel_m);
  static float mean(const PolarImage& image, const Footprint& of);

  FanStyle style_;
  PolarImage shape_;  // shape of the images for which footprints_ were made; has no samples
  FanLayout layout_;
  std::vector<Footprint> footprints_;  // [height][width]
};

/// Distance between range rings: 1, 2 or 5 times a power of ten, four to ten rings.
double ring_spacing_m(double range_m);

// Computes outlines of regions of a picture, along the edges of pixels. They become polygons of labels.

/// A corner between pixels: pixel (x, y) lies between the corners (x, y) and (x + 1, y + 1).
struct Corner {
  int x = 0, y = 0;
  bool operator==(const Corner&) const = default;
};
using Outline = std::vector<Corner>;  // clockwise on the screen (y downwards); only corners where the direction changes

/// Outlines of the connected regions (by shared edges) of pixels in [x0, x1) by [y0, y1) for which `is_in` is true. Holes are
/// ignored. The regions are ordered by their first pixels, row by row.
std::vector<Outline> outlines(int x0, int y0, int x1, int y1, const std::function<bool(int x, int y)>& is_in);

}  // namespace sonar
