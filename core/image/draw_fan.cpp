#include "core/image/draw_fan.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <optional>

#include "core/base/geometry.hpp"

namespace sonar {
namespace {

/// The fractional position in the table of beams; beam k spans [k - 0.5, k + 0.5]. nullopt outside the fan. If the fan is a
/// full circle, every direction is in the fan.
std::optional<double> beam_at(const std::vector<double>& azimuth_rad, double azimuth) {
  const auto next = std::lower_bound(azimuth_rad.begin(), azimuth_rad.end(), azimuth, std::greater<>());
  const auto right = std::clamp<std::ptrdiff_t>(next - azimuth_rad.begin(), 1, std::ssize(azimuth_rad) - 1);
  const double a = azimuth_rad[static_cast<std::size_t>(right - 1)], b = azimuth_rad[static_cast<std::size_t>(right)];
  const double beam = static_cast<double>(right - 1) + (a - azimuth) / (a - b);
  const auto beams = static_cast<double>(azimuth_rad.size());
  if (beam >= -0.5 && beam <= beams - 0.5) return beam;
  const double span = azimuth_rad.front() - azimuth_rad.back(), step = span / (beams - 1);
  if (span + 1.001 * step < 2 * pi) return std::nullopt;
  return std::clamp(beam < 0 ? beam + beams : beam - beams, -0.5, beams - 0.5);
}

struct Interval {
  double low = 0, high = 0;
};
/// The cells of an interval of `width` around `centre`, limited to the existing cells.
Interval box_around(double centre, double width, std::size_t cells) {
  const double limit = static_cast<double>(cells);
  const double low = std::clamp(centre - width / 2, 0.0, limit - 1e-6);
  return {low, std::clamp(centre + width / 2, low + 1e-6, limit)};
}

/// The cells [first, last] that an interval touches, weighted by their overlap.
struct Span {
  double low, high;
  std::size_t first, last;
  Span(double from, double to, std::size_t cells)
      : low(from), high(to), first(static_cast<std::size_t>(from)), last(std::min(cells - 1, static_cast<std::size_t>(to))) {}
  double weight(std::size_t i) const {
    return std::max(0.0, std::min(high, static_cast<double>(i) + 1) - std::max(low, static_cast<double>(i)));
  }
};

void draw_rings(Raster& raster, const PolarImage& image, const FanLayout& layout) {
  const double spacing = ring_spacing_m(image.range_m());
  const int scale = std::max(1, layout.width / 400);
  for (int ring = 1; ring * spacing <= image.range_m() * 1.0001; ++ring) {
    const double radius = ring * spacing / layout.metres_per_pixel;
    const double from = image.azimuth_rad.back(), to = image.azimuth_rad.front();
    const int steps = static_cast<int>(radius * (to - from) * 2) + 2;
    for (int i = 0; i <= steps; ++i) {
      const double azimuth = from + (to - from) * i / steps;
      blend(raster, static_cast<int>(layout.x_of(azimuth, ring * spacing)),
            static_cast<int>(layout.y_of(azimuth, ring * spacing)), ring_colour, 0.12f);
    }
    char label[32];
    std::snprintf(label, sizeof label, "%g m", ring * spacing);
    const int x = static_cast<int>(layout.x_of(from, ring * spacing)) + 3 * scale;
    const int y = static_cast<int>(layout.y_of(from, ring * spacing)) - scale;
    draw_text(raster, std::min(x, layout.width - text_width(label, scale) - 1), y, label, label_colour, scale);
  }
}

Result<void> check(const PolarImage& image, const FanStyle& style) {
  if (style.width_px < 64 || style.width_px > 8000)
    return failure(ErrorKind::usage,
                   "the picture would be " + std::to_string(style.width_px) + " pixels wide: choose 64 to 8000");
  if (image.rows < 1 || image.beams < 2 || !(image.row_spacing_m > 0) || !std::isfinite(image.row_spacing_m) ||
      !(image.start_m >= 0) || !std::isfinite(image.start_m))
    return failure(ErrorKind::bad_data, "the ping cannot be drawn: it has " + std::to_string(image.rows) + " rows of " +
                                            std::to_string(image.beams) + " beams");
  for (std::size_t i = 1; i < image.beams; ++i)
    if (image.azimuth_rad[i] >= image.azimuth_rad[i - 1])
      return failure(ErrorKind::bad_data, "the bearing table does not run from port to starboard at beam " + std::to_string(i));
  if (image.azimuth_rad.front() > pi + 1e-6 || image.azimuth_rad.back() < -pi - 1e-6)
    return failure(ErrorKind::bad_data, "the bearing table covers more than a circle");
  return {};
}

}  // namespace

FanLayout fan_layout(const PolarImage& image, const FanStyle& style, Opens opens) {
  const double half_aperture = std::max(std::abs(image.azimuth_rad.front()), std::abs(image.azimuth_rad.back()));
  const double margin = style.rings ? 28 : 4;
  FanLayout layout;
  layout.width = style.width_px;
  layout.metres_per_pixel = 2 * image.range_m() * std::sin(std::min(half_aperture, pi / 2)) / (style.width_px - 2 * margin);
  // Without this limit a very narrow fan would be very tall.
  layout.metres_per_pixel = std::max(layout.metres_per_pixel, image.range_m() / (4.0 * style.width_px));
  layout.apex_x = style.width_px / 2.0;
  const double ahead = image.range_m() / layout.metres_per_pixel;
  const double behind = std::max(0.0, -std::cos(half_aperture)) * ahead;
  const bool is_up = opens == Opens::upwards;
  layout.up = is_up ? 1 : -1;
  layout.apex_y = margin + (is_up ? ahead : behind);
  layout.height = static_cast<int>(std::ceil(margin + ahead + behind + margin));
  return layout;
}

double ring_spacing_m(double range_m) {
  const double decade = std::pow(10.0, std::floor(std::log10(range_m)));
  for (const double step : {0.1, 0.2, 0.5, 1.0})
    if (range_m / (step * decade) <= 10) return step * decade;
  return 2 * decade;
}

/// A footprint that is smaller than a cell is widened to one cell. The picture is then interpolated linearly.
FanPainter::Footprint FanPainter::footprint(const PolarImage& image, double x_m, double y_m, double pixel_m) {
  const double range = std::hypot(x_m, y_m);
  if (range < image.start_m || range >= image.range_m()) return {};
  const std::optional<double> beam = beam_at(image.azimuth_rad, std::atan2(-x_m, y_m));
  if (!beam) return {};
  const double beam_spacing = (image.azimuth_rad.front() - image.azimuth_rad.back()) / static_cast<double>(image.beams - 1);
  const double beams_wide = pixel_m / std::max(range, pixel_m) / beam_spacing;
  const double row = (range - image.start_m) / image.row_spacing_m;
  const Interval rows = box_around(row, std::max(1.0, pixel_m / image.row_spacing_m), image.rows);
  const Interval beams = box_around(*beam + 0.5, std::max(1.0, beams_wide), image.beams);
  return {rows.low, rows.high, beams.low, beams.high};
}

float FanPainter::mean(const PolarImage& image, const Footprint& of) {
  const Span rows(of.row_low, of.row_high, image.rows), beams(of.beam_low, of.beam_high, image.beams);
  double sum = 0, weights = 0;
  for (std::size_t r = rows.first; r <= rows.last; ++r) {
    for (std::size_t b = beams.first; b <= beams.last; ++b) {
      const double weight = rows.weight(r) * beams.weight(b);
      sum += weight * static_cast<double>(image.at(r, b));
      weights += weight;
    }
  }
  return static_cast<float>(sum / weights);
}

bool FanPainter::fits(const PolarImage& image, Opens opens) const {
  return (layout_.up > 0) == (opens == Opens::upwards) && !footprints_.empty() && image.rows == shape_.rows &&
         image.beams == shape_.beams && image.start_m == shape_.start_m && image.row_spacing_m == shape_.row_spacing_m &&
         image.azimuth_rad == shape_.azimuth_rad;
}

void FanPainter::lay_out(const PolarImage& image, Opens opens) {
  shape_ = {image.rows, image.beams, image.row_spacing_m, image.azimuth_rad, {}, image.full_scale, image.start_m};
  layout_ = fan_layout(image, style_, opens);
  footprints_.clear();
  footprints_.reserve(static_cast<std::size_t>(layout_.width) * static_cast<std::size_t>(layout_.height));
  for (int y = 0; y < layout_.height; ++y) {
    for (int x = 0; x < layout_.width; ++x) {
      const double x_m = (x + 0.5 - layout_.apex_x) * layout_.metres_per_pixel;
      const double y_m = layout_.up * (layout_.apex_y - y - 0.5) * layout_.metres_per_pixel;
      footprints_.push_back(footprint(image, x_m, y_m, layout_.metres_per_pixel));
    }
  }
}

Result<Raster> FanPainter::draw(const PolarImage& image, Opens opens) {
  if (!fits(image, opens)) {
    if (Result<void> sound = check(image, style_); !sound) return tl::unexpected(sound.error());
    lay_out(image, opens);
  }
  Raster raster(layout_.width, layout_.height);
  for (std::size_t i = 0; i < footprints_.size(); ++i)
    raster.pixels[i] =
        footprints_[i].is_outside() ? outside_colour : style_.colours.colour(image.brightness(mean(image, footprints_[i])));
  if (style_.rings) draw_rings(raster, image, layout_);
  return raster;
}

Result<Raster> draw_fan(const PolarImage& image, const FanStyle& style) { return FanPainter(style).draw(image); }

std::vector<Outline> outlines(int x0, int y0, int x1, int y1, const std::function<bool(int x, int y)>& is_in) {
  const auto in = [&](int x, int y) { return x >= x0 && x < x1 && y >= y0 && y < y1 && is_in(x, y); };
  const int width = x1 - x0;
  const auto place = [&](int x, int y) {
    return static_cast<std::size_t>(y - y0) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x - x0);
  };
  std::vector<bool> followed(static_cast<std::size_t>(width) * static_cast<std::size_t>(y1 - y0),
                             false);  // true if a pixel's upper edge is already part of an outline
  std::vector<Outline> found;
  for (int y = y0; y < y1; ++y)
    for (int x = x0; x < x1; ++x) {
      if (!in(x, y) || in(x, y - 1) || followed[place(x, y)]) continue;
      // Follows an edge with the region on its right. For each direction, the tables contain the pixels ahead of a corner, on
      // the right and on the left.
      constexpr int dx[] = {1, 0, -1, 0}, dy[] = {0, 1, 0, -1};
      constexpr int right_x[] = {0, -1, -1, 0}, right_y[] = {0, 0, -1, -1}, left_x[] = {0, 0, -1, -1}, left_y[] = {-1, 0, 0, -1};
      Outline outline{{x, y}};
      Corner at{x, y};
      std::size_t way = 0;
      long twice_area = 0;
      do {
        if (way == 0) followed[place(at.x, at.y)] = true;
        const Corner next{at.x + dx[way], at.y + dy[way]};
        twice_area += static_cast<long>(at.x) * next.y - static_cast<long>(next.x) * at.y;
        at = next;
        const std::size_t before = way;
        if (!in(at.x + right_x[way], at.y + right_y[way]))
          way = (way + 1) % 4;
        else if (in(at.x + left_x[way], at.y + left_y[way]))
          way = (way + 3) % 4;
        if (way != before && !(at == outline.front())) outline.push_back(at);
      } while (!(at == outline.front() && way == 0));
      if (twice_area > 0) found.push_back(std::move(outline));  // outlines of holes run in the opposite direction
    }
  return found;
}

}  // namespace sonar
