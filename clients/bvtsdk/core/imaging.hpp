// Forms images from polar pings. As in the real SDK, the library does this, not the sonar. It computes the geometry first, then
// the pixels. Words in this folder: verified = seen in public client code; inferred = concluded from it; chosen = our choice,
// because nothing is known.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

#include "clients/bvtsdk/core/codes.hpp"
#include "clients/bvtsdk/core/polar_ping.hpp"

namespace sonar::bvt {

enum class ImageType { xy = 0, r_theta = 1 };

/// Rows of an image (our choice). low: 256; medium: 512; high: 1000. automatic: as many as the ping has bins, but from 200 to
/// 1000, and fewer if the image would have over a million pixels, because clients keep whole images on their stack.
/// off: the same as automatic.
enum class ImageRes { off = 0, low = 1, medium = 2, high = 3, automatic = 4 };

/// The position where an XY image begins: the nearest corners of the sector, or the sonar.
enum class XyBottom { sector, sonar };
/// Reads the environment variable BVE_XY (sector or sonar); the default is sector.
XyBottom xy_bottom_from_environment();

/// Smoothing of a finished image. If several flags are set, the lowest applies. The values are verified; to filter the finished
/// image, not the samples, is our choice.
enum FilterFlags : int { no_filter = 0, mean_3x3 = 2, mean_9x2 = 16 };

struct ImageSettings {
  ImageRes resolution = ImageRes::automatic;
  XyBottom xy_bottom = xy_bottom_from_environment();
  /// Values that the program requested; 0 = none. A size has priority over a range resolution, which has priority over
  /// `resolution` (our choice).
  float range_resolution_m = 0;                   // metres per row; at most a million pixels are made for it
  int requested_height = 0, requested_width = 0;  // XY keeps the height and adjusts the width (verified); a width alone sets both
  int r_theta_width = 0;                          // columns; has priority over requested_width
  int filter_flags = no_filter;
  float noise_threshold = 0;     // fraction of full scale below which samples become 0
  float clipping_threshold = 0;  // fraction of full scale above which samples are cut to it; 0 = off
  int sound_speed_override_mps =
      0;  // 0 = that of the ping; otherwise ranges are multiplied by override / sound speed of the ping
};

/// Geometry of the pixels of an image. Row-major (verified), angles clockwise from ahead in degrees (verified).
struct ImageGeometry {
  ImageType type = ImageType::xy;
  int height = 0, width = 0;
  double range_resolution_m = 0;       // per row; XY: pixels are square
  double bearing_resolution_deg = 0;   // per column; 0 in XY
  int origin_row = 0, origin_col = 0;  // the sonar, usually outside the image
  float fov_min_deg = 0, fov_max_deg = 0;
  double start_m = 0, stop_m = 0;  // ends of the shown area, with the sound speed override

  /// Row and column may lie outside the image, because clients pass the index after the last (verified). R-Theta labels a column
  /// by its left edge (verified). XY counts whole pixels from the origin (verified): x = (col - origin_col) * range_resolution_m
  /// to starboard, y = (origin_row - row) * range_resolution_m ahead.
  double pixel_range_m(int row, int col) const;
  double pixel_bearing_deg(int row, int col) const;
  std::size_t pixel_count() const { return static_cast<std::size_t>(height) * static_cast<std::size_t>(width); }
};

struct MagImage : ImageGeometry {
  std::vector<std::uint16_t> pixels;  // 65535 = full scale (verified)
};

/// Computes size and scale of the image of a ping. Returns no_ping_signal for a ping without samples, bad_parameter for negative
/// sizes or resolutions, and invalid_image_size for more than 32 million pixels.
Code plan_image(const PolarPing& ping, ImageType type, const ImageSettings& settings, ImageGeometry& geometry);

/// Makes images and keeps the lookup tables of the last few XY geometries. Several threads may use one Imager.
class Imager {
 public:
  /// Returns the codes of plan_image, or memory_alloc. On failure `image` is empty.
  Code make(const PolarPing& ping, ImageType type, const ImageSettings& settings, MagImage& image);

 private:
  std::shared_ptr<const PolarLookup> lookup_for(const PolarLookup::Key& key);

  std::mutex mutex_;
  std::array<std::shared_ptr<const PolarLookup>, 4> recent_;  // latest first
};

/// `pixels`: row-major, rows x columns. Replaces each pixel with the mean of 3 x 3 pixels, or of 9 rows x 2 columns (this column
/// and the next: our choice, because the vendor's is unknown). Pixels outside the image do not count. Other flags have no effect.
/// May throw std::bad_alloc.
void filter_image(int flags, int rows, int columns, std::vector<std::uint16_t>& pixels);

}  // namespace sonar::bvt
