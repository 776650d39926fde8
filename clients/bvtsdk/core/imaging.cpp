#include "clients/bvtsdk/core/imaging.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <new>

#include "clients/bvtsdk/core/polar_ping.hpp"

namespace sonar::bvt {
namespace {

constexpr double most_pixels = 32e6;  // limit for any image
constexpr double usual_pixels = 1e6;  // default size limit: clients keep 4 bytes per pixel on an 8 MB stack (verified)

int to_int(double x) {
  constexpr double limit = std::numeric_limits<int>::max();
  return static_cast<int>(std::lround(std::clamp(x, -limit, limit)));
}

/// Ranges of a ping as the image shows them.
struct Extent {
  double start_m, stop_m, bin_m;
};
Extent extent_of(const PolarPing& ping, int sound_speed_override_mps) {
  const double scale = range_scale(ping, sound_speed_override_mps);
  return {scale * static_cast<double>(ping.start_m), scale * static_cast<double>(ping.stop_m),
          scale * static_cast<double>(ping.bin_m)};
}

/// Returns the number of rows when no size was requested. The rows show `shown_m` of range; `columns_per_row` is width / height,
/// not used if `fixed_columns` gives the width.
int rows_by_resolution(const Extent& extent, const ImageSettings& settings, double shown_m, double columns_per_row,
                       double fixed_columns) {
  double rows = 0;
  if (settings.range_resolution_m > 0) {
    rows = shown_m / static_cast<double>(settings.range_resolution_m);
  } else {
    switch (settings.resolution) {
      case ImageRes::low:
        return 256;
      case ImageRes::medium:
        return 512;
      case ImageRes::high:
        return 1000;
      case ImageRes::off:
      case ImageRes::automatic:
        break;
    }
    rows = std::clamp(std::round((extent.stop_m - extent.start_m) / extent.bin_m), 200.0, 1000.0);
  }
  const double usual = fixed_columns > 0 ? usual_pixels / fixed_columns : std::sqrt(usual_pixels / columns_per_row);
  return std::max(1, to_int(std::min(std::round(rows), std::floor(usual))));
}

/// Plans an XY image. Verified: a public table has the range and bearing of every pixel of one image (SDK 3.x, 45 degree head, 2
/// to 15 m requested, 394 x 480): x = (col - 197) 0.026401 m, y = (550 - row) 0.026401 m. So the image ends 70 rows above the
/// sonar, and the distances of pixels from the sonar are whole numbers of rows and columns. Inferred: the bottom passes through
/// the sector's nearest corners, at start * cos(half angle); the top is at the stop range, and the sides touch the widest points
/// of the sector. Unknown: sector and stop range of that ping. With a half angle of 20.9 to 21 degrees and stop 14.54 m, rounding
/// down the number of rows below the image gives 70 rows and 197 columns. With rounding to nearest, no sector gives these
/// numbers.
void plan_xy(const Extent& extent, const ImageSettings& settings, ImageGeometry& g) {
  const double half_deg = std::max(std::abs(static_cast<double>(g.fov_min_deg)), std::abs(static_cast<double>(g.fov_max_deg)));
  const double half_rad = std::min(half_deg, 90.0) / degrees;
  const double bottom_m = settings.xy_bottom == XyBottom::sonar ? 0 : extent.start_m * std::cos(half_rad);
  const double shown_m = extent.stop_m - bottom_m, half_width_m = extent.stop_m * std::sin(half_rad);
  if (settings.requested_height > 0)
    g.height = settings.requested_height;
  else if (settings.requested_width > 0)
    g.height = std::max(1, to_int(std::min(settings.requested_width * shown_m / (2 * half_width_m), most_pixels)));
  else
    g.height = rows_by_resolution(extent, settings, shown_m, 2 * half_width_m / shown_m, 0);
  constexpr double rounding = 1e-9;  // rounding error of these divisions
  g.range_resolution_m = shown_m / g.height;
  g.width = 2 * std::max(1, to_int(std::min(std::ceil(half_width_m / g.range_resolution_m - rounding), most_pixels)));
  g.origin_row = to_int(g.height + std::floor(bottom_m / g.range_resolution_m + rounding));
  g.origin_col = g.width / 2;
}

void plan_r_theta(const Extent& extent, const ImageSettings& settings, int beams, ImageGeometry& g) {
  const double shown_m = extent.stop_m - extent.start_m;
  g.width = settings.r_theta_width > 0 ? settings.r_theta_width : settings.requested_width > 0 ? settings.requested_width : beams;
  g.height = settings.requested_height > 0 ? settings.requested_height
                                           : rows_by_resolution(extent, settings, shown_m, 0, static_cast<double>(g.width));
  g.range_resolution_m = shown_m / g.height;
  g.bearing_resolution_deg = (static_cast<double>(g.fov_max_deg) - static_cast<double>(g.fov_min_deg)) / g.width;
  g.origin_row = to_int(g.height + std::round(extent.start_m / g.range_resolution_m));
  g.origin_col = to_int(std::round(-static_cast<double>(g.fov_min_deg) / g.bearing_resolution_deg));
}

/// Row 0 is the far end (inferred from one client that flips the image). A pixel shows the strongest of the samples that
/// it covers. If it covers no whole sample, it shows the one at its centre (our choice). So no echo falls between the rows.
void fill_r_theta(const PolarGrid& grid, const Extent& extent, MagImage& image) {
  struct Bins {
    int from, to;
  };
  std::vector<Bins> bins_of_row(static_cast<std::size_t>(image.height));
  const auto bin_at = [&](double x) { return static_cast<int>(std::clamp(x, 0.0, static_cast<double>(grid.bins))); };
  for (int row = 0; row < image.height; ++row) {
    const double far = (image.height - row) * image.range_resolution_m / extent.bin_m;
    const double near = (image.height - row - 1) * image.range_resolution_m / extent.bin_m;
    const double centre = std::floor((near + far) / 2);
    Bins bins{bin_at(std::round(near)), bin_at(std::round(far))};
    if (bins.from >= bins.to) bins = {bin_at(centre), bin_at(centre + 1)};
    bins_of_row[static_cast<std::size_t>(row)] = bins;
  }
  constexpr int block = 16;  // columns at once, so that a row is written in runs
  const auto width = static_cast<std::size_t>(image.width);
  for (int first = 0; first < image.width; first += block)
    for (int row = 0; row < image.height; ++row) {
      const Bins bins = bins_of_row[static_cast<std::size_t>(row)];
      std::uint16_t* const pixels = image.pixels.data() + static_cast<std::size_t>(row) * width;
      for (int col = first; col < std::min(first + block, image.width); ++col) {
        const auto beam_at = [&](int c) { return static_cast<int>(static_cast<std::int64_t>(c) * grid.beams / image.width); };
        const int from = beam_at(col), to = std::max(from + 1, beam_at(col + 1));
        std::uint16_t strongest = 0;
        for (int beam = from; beam < to; ++beam) {
          const std::uint16_t* const samples =
              grid.samples + static_cast<std::size_t>(beam) * static_cast<std::size_t>(grid.bins);
          for (int bin = bins.from; bin < bins.to; ++bin) strongest = std::max(strongest, samples[bin]);
        }
        pixels[col] = strongest;
      }
    }
}

/// The pixels over which the mean for (row, col) is computed: rows row - above to row + below, columns col - left to col + right.
struct Window {
  int above, below, left, right;
};

/// Moves the window over the rows: a row is added to `sums` when the window reaches it, and subtracted when the window has left
/// it. `sums` has zeros on both sides, so that the inner loop needs no tests.
void mean_over(const Window& window, int height, int columns, std::vector<std::uint16_t>& pixels) {
  const auto width = static_cast<std::size_t>(columns);
  const auto margin = static_cast<std::size_t>(window.left + window.right);
  std::vector<std::uint16_t> out(pixels.size());
  std::vector<std::uint32_t> sums(width + margin, 0);  // for each column, the sum over the rows of the window
  std::vector<float> inside(width, 0);                 // for each column, the number of window columns in the image
  for (int col = 0; col < columns; ++col)
    inside[static_cast<std::size_t>(col)] =
        static_cast<float>(std::min(col, window.left) + 1 + std::min(columns - 1 - col, window.right));
  std::uint32_t* const inner = sums.data() + window.left;
  const auto row_at = [&](int row) { return pixels.data() + static_cast<std::size_t>(row) * width; };
  const auto add = [&](int row) {
    const std::uint16_t* const in = row_at(row);
    for (std::size_t c = 0; c < width; ++c) inner[c] += in[c];
  };
  const auto subtract = [&](int row) {
    const std::uint16_t* const in = row_at(row);
    for (std::size_t c = 0; c < width; ++c) inner[c] -= in[c];
  };
  for (int row = 0; row < std::min(window.below, height); ++row) add(row);
  for (int row = 0; row < height; ++row) {
    if (row + window.below < height) add(row + window.below);
    if (row - window.above - 1 >= 0) subtract(row - window.above - 1);
    const int rows = std::min(row, window.above) + 1 + std::min(height - 1 - row, window.below);
    std::uint16_t* const to = out.data() + static_cast<std::size_t>(row) * width;
    for (std::size_t c = 0; c < width; ++c) {
      std::uint32_t sum = 0;
      for (std::size_t i = 0; i <= margin; ++i) sum += sums[c + i];
      // Sums of 18 pixels are exact in a float.
      to[c] = static_cast<std::uint16_t>(
          static_cast<int>(static_cast<float>(static_cast<int>(sum)) / (inside[c] * static_cast<float>(rows)) + 0.5f));
    }
  }
  pixels = std::move(out);
}

}  // namespace

XyBottom xy_bottom_from_environment() {
  const char* const bottom = std::getenv("BVE_XY");
  return bottom && std::strcmp(bottom, "sonar") == 0 ? XyBottom::sonar : XyBottom::sector;
}

double ImageGeometry::pixel_range_m(int row, int col) const {
  if (type == ImageType::r_theta) return std::max(0.0, stop_m - (row + 0.5) * range_resolution_m);
  return range_resolution_m * std::hypot(static_cast<double>(col) - origin_col, static_cast<double>(origin_row) - row);
}

double ImageGeometry::pixel_bearing_deg(int row, int col) const {
  if (type == ImageType::r_theta) return static_cast<double>(fov_min_deg) + col * bearing_resolution_deg;
  return degrees * std::atan2(static_cast<double>(col) - origin_col, static_cast<double>(origin_row) - row);
}

Code plan_image(const PolarPing& ping, ImageType type, const ImageSettings& settings, ImageGeometry& geometry) {
  geometry = {};
  if (!ping.has_signal()) return no_ping_signal;
  if (settings.requested_height < 0 || settings.requested_width < 0 || settings.r_theta_width < 0 ||
      !(settings.range_resolution_m >= 0) || settings.sound_speed_override_mps < 0)
    return bad_parameter;
  const Extent extent = extent_of(ping, settings.sound_speed_override_mps);
  ImageGeometry g;
  g.type = type;
  g.fov_min_deg = ping.fov_min_deg;
  g.fov_max_deg = ping.fov_max_deg;
  g.start_m = extent.start_m;
  g.stop_m = extent.stop_m;
  if (settings.requested_height > most_pixels || settings.requested_width > most_pixels || settings.r_theta_width > most_pixels)
    return invalid_image_size;
  if (type == ImageType::xy)
    plan_xy(extent, settings, g);
  else
    plan_r_theta(extent, settings, ping.beams, g);
  if (static_cast<double>(g.height) * static_cast<double>(g.width) > most_pixels) return invalid_image_size;
  geometry = g;
  return success;
}

std::shared_ptr<const PolarLookup> Imager::lookup_for(const PolarLookup::Key& key) {
  const auto find = [&]() -> std::shared_ptr<const PolarLookup> {
    const auto found = std::find_if(recent_.begin(), recent_.end(), [&](const auto& l) { return l && l->key() == key; });
    if (found == recent_.end()) return nullptr;
    std::rotate(recent_.begin(), found, found + 1);
    return recent_.front();
  };
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (auto known = find()) return known;
  }
  auto made = std::make_shared<const PolarLookup>(key);  // outside the lock, so that other threads do not wait
  const std::lock_guard<std::mutex> lock(mutex_);
  std::rotate(recent_.begin(), recent_.end() - 1, recent_.end());
  return recent_.front() = std::move(made);
}

Code Imager::make(const PolarPing& ping, ImageType type, const ImageSettings& settings, MagImage& image) {
  image = {};
  ImageGeometry geometry;
  const Code planned = plan_image(ping, type, settings, geometry);
  if (planned != success) return planned;
  try {
    static_cast<ImageGeometry&>(image) = geometry;
    image.pixels.assign(geometry.pixel_count(), 0);
    Extent extent = extent_of(ping, settings.sound_speed_override_mps);
    // If XY rows have two bins or more, a row shows the strongest of its bins (our choice), so that no echo is missed.
    const int pooled =
        type == ImageType::xy ? std::max(1, to_int(std::floor(image.range_resolution_m / extent.bin_m + 1e-9))) : 1;
    const SampleGrid grid(ping, settings.noise_threshold, settings.clipping_threshold, pooled);
    extent.bin_m *= grid.pooled();
    if (type == ImageType::r_theta) {
      fill_r_theta(grid.view(), extent, image);
    } else {
      const PolarLookup::Key key{image.height,
                                 image.width,
                                 image.origin_row,
                                 image.origin_col,
                                 image.range_resolution_m,
                                 extent.start_m,
                                 extent.stop_m,
                                 extent.bin_m,
                                 static_cast<double>(image.fov_min_deg),
                                 static_cast<double>(image.fov_max_deg),
                                 grid.view().beams,
                                 grid.view().bins};
      lookup_for(key)->apply(grid.view(), image.pixels.data());
    }
    filter_image(settings.filter_flags, image.height, image.width, image.pixels);
  } catch (const std::bad_alloc&) {
    image = {};
    return memory_alloc;
  }
  return success;
}

void filter_image(int flags, int rows, int columns, std::vector<std::uint16_t>& pixels) {
  if (pixels.empty()) return;
  if (flags & mean_3x3)
    mean_over({1, 1, 1, 1}, rows, columns, pixels);
  else if (flags & mean_9x2)
    mean_over({4, 4, 0, 1}, rows, columns, pixels);
}

}  // namespace sonar::bvt
