#include "core/image/draw_picture.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "core/base/geometry.hpp"

namespace sonar {
namespace {

constexpr Rgb head_colour{79, 184, 255};
constexpr double waterfall_shape = 0.75;  // height divided by width
constexpr double closest_marks = 0.06;    // as a fraction of the height
constexpr float not_measured = -1;

/// The number of rows that fill the height of a waterfall.
std::size_t rows_shown(const PolarImage& waterfall) { return std::clamp(waterfall.rows, waterfall_fewest_rows, waterfall_rows); }

/// The cells [first, last) that pixel `at` covers when `cells` cells fill `pixels` pixels; at least one cell.
std::pair<std::size_t, std::size_t> cells_under(int at, int pixels, std::size_t cells) {
  const auto first = static_cast<std::size_t>(at) * cells / static_cast<std::size_t>(pixels);
  return {first, std::max(first + 1, static_cast<std::size_t>(at + 1) * cells / static_cast<std::size_t>(pixels))};
}

/// The mean of the cells that were measured.
float mean_of(const PolarImage& image, std::pair<std::size_t, std::size_t> rows, std::pair<std::size_t, std::size_t> columns) {
  float sum = 0;
  int count = 0;
  for (std::size_t row = rows.first; row < rows.second; ++row)
    for (std::size_t column = columns.first; column < columns.second; ++column) {
      if (image.at(row, column) < 0) continue;
      sum += image.at(row, column);
      ++count;
    }
  return count > 0 ? sum / static_cast<float>(count) : not_measured;
}

/// Draws a rectangle of cells. `rows` cells fill the height, even if the image has fewer rows.
Raster draw_cells(const PolarImage& image, std::size_t rows, const FanStyle& style, int height) {
  Raster raster(style.width_px, height);
  for (int y = 0; y < height; ++y) {
    const auto [first, last] = cells_under(y, height, rows);
    for (int x = 0; x < style.width_px; ++x) {
      const float mean = first >= image.rows
                             ? not_measured
                             : mean_of(image, {first, std::min(last, image.rows)}, cells_under(x, style.width_px, image.beams));
      raster.at(x, y) = mean < 0 ? outside_colour : style.colours.colour(image.brightness(mean));
    }
  }
  return raster;
}

/// Writes a value; its upper left corner is (x, y).
void draw_label(Raster& raster, int x, int y, double value, const char* unit, int scale) {
  char label[32];
  std::snprintf(label, sizeof label, "%g%s", value == 0 ? 0 : value, unit);
  const int width = text_width(label, scale);
  const int from = std::clamp(x, 0, std::max(0, raster.width - width - 1));
  for (int dy = -2 * scale; dy < 7 * scale; ++dy)  // echoes may be as bright as the label
    for (int i = -2 * scale; i < width + 2 * scale; ++i) blend(raster, from + i, y + dy, outside_colour, 0.7f);
  draw_text(raster, from, y, label, label_colour, scale);
}

/// Draws vertical lines at multiples of `step`; `left` and `right` are the values at the edges of the picture.
void draw_axis(Raster& raster, double left, double right, double step, const char* unit) {
  const int scale = std::max(1, raster.width / 400);
  const double low = std::min(left, right), high = std::max(left, right);
  for (double at = std::ceil(low / step) * step; at <= high + 1e-9; at += step) {
    const int x = static_cast<int>((at - left) / (right - left) * (raster.width - 1));
    for (int y = 0; y < raster.height; ++y) blend(raster, x, y, ring_colour, 0.12f);
    draw_label(raster, x + 2 * scale, 2 * scale, at, unit, scale);
  }
}

void draw_times(Raster& raster, const SonarPicture& waterfall) {
  const int scale = std::max(1, raster.width / 400);
  for (const TimeMark& mark : time_marks(waterfall)) {
    const int y = static_cast<int>(mark.part * (raster.height - 1));
    for (int x = 0; x < raster.width; ++x) blend(raster, x, y, ring_colour, 0.12f);
    if (y + 9 * scale <= raster.height) draw_label(raster, 2 * scale, y + 2 * scale, mark.age_s, " s", scale);
  }
}

void draw_head(Raster& raster, const SonarPicture& picture, const FanLayout& layout) {
  for (double range_m = 0; range_m < picture.range_m(); range_m += 0.5 * layout.metres_per_pixel)
    blend(raster, static_cast<int>(layout.x_of(picture.head_rad, range_m)),
          static_cast<int>(layout.y_of(picture.head_rad, range_m)), head_colour, 0.6f);
}

void draw_points(Raster& raster, const SonarPicture& picture, const FanLayout& layout, Rgb colour) {
  const int radius = std::max(1, raster.width / 240);
  for (const auto& [azimuth, range_m] : picture.points) {
    if (!(range_m >= 0 && range_m <= picture.range_m())) continue;
    const int x = static_cast<int>(layout.x_of(azimuth, range_m)), y = static_cast<int>(layout.y_of(azimuth, range_m));
    for (int dy = -radius; dy <= radius; ++dy)
      for (int dx = -radius; dx <= radius; ++dx)
        if (dx * dx + dy * dy <= radius * radius) blend(raster, x + dx, y + dy, colour, 1);
  }
}

Result<void> check_cells(const SonarPicture& picture, const FanStyle& style) {
  const PolarImage& image = picture.image;
  if (style.width_px < 64 || style.width_px > 8000)
    return failure(ErrorKind::usage,
                   "the picture would be " + std::to_string(style.width_px) + " pixels wide: choose 64 to 8000");
  const bool has_sides = picture.kind == PictureKind::waterfall
                             ? image.row_spacing_m > 0
                             : image.azimuth_rad.size() == image.beams && picture.elevation_rad > 0 &&
                                   picture.elevation_rad < pi && image.azimuth_rad.front() > image.azimuth_rad.back();
  if (image.rows >= 1 && image.beams >= 2 && has_sides && image.samples.size() == image.rows * image.beams) return {};
  return failure(ErrorKind::bad_data, "the ping cannot be drawn: it has " + std::to_string(image.rows) + " rows of " +
                                          std::to_string(image.beams) + " cells");
}

}  // namespace

int picture_height(const SonarPicture& picture, const FanStyle& style) {
  if (picture.is_polar()) return fan_layout(picture.image, style, opens_of(picture)).height;
  const double shape = picture.kind == PictureKind::waterfall
                           ? waterfall_shape
                           : 2 * picture.elevation_rad / (picture.image.azimuth_rad.front() - picture.image.azimuth_rad.back());
  return std::max(1, static_cast<int>(std::lround(style.width_px * std::min(shape, 4.0))));
}

Result<Raster> PicturePainter::draw(const SonarPicture& picture) {
  const PolarImage& image = picture.image;
  if (picture.is_polar()) {
    Result<Raster> raster = fan_.draw(image, opens_of(picture));
    if (!raster) return raster;
    const FanLayout layout = fan_layout(image, style_, opens_of(picture));
    if (picture.kind == PictureKind::sweep && style_.rings) draw_head(*raster, picture, layout);
    draw_points(*raster, picture, layout, style_.colours.colour(1));
    return raster;
  }
  if (Result<void> sound = check_cells(picture, style_); !sound) return tl::unexpected(sound.error());
  const bool falls = picture.kind == PictureKind::waterfall;
  const std::size_t rows = falls ? rows_shown(image) : image.rows;
  Raster raster = draw_cells(image, rows, style_, picture_height(picture, style_));
  if (!style_.rings) return raster;
  if (falls) {
    draw_axis(raster, image.start_m, picture.range_m(), ring_spacing_m(picture.range_m()), " m");
    draw_times(raster, picture);
  } else {
    draw_axis(raster, -deg_from_rad(image.azimuth_rad.front()), -deg_from_rad(image.azimuth_rad.back()), 15, "");
  }
  return raster;
}

std::vector<TimeMark> time_marks(const SonarPicture& waterfall) {
  const std::vector<double>& ages = waterfall.row_age_s;
  std::vector<TimeMark> marks;
  if (ages.size() < 2 || ages.size() != waterfall.image.rows || !(ages.back() > 0)) return marks;
  const auto rows = static_cast<double>(rows_shown(waterfall.image));
  const double step_s = ring_spacing_m(ages.back() * rows / static_cast<double>(ages.size()));
  double passed = 0;  // number of steps that the rows so far have passed
  for (std::size_t row = 1; row < ages.size(); ++row) {
    const double steps = std::floor(ages[row] / step_s);
    if (!(steps > passed)) continue;
    passed = steps;
    const double beyond =
        (steps * step_s - ages[row - 1]) / (ages[row] - ages[row - 1]);  // distance from the middle of the row before
    const double part = (static_cast<double>(row) - 0.5 + beyond) / rows;
    if (part - (marks.empty() ? 0 : marks.back().part) >= closest_marks) marks.push_back({part, steps * step_s});
  }
  return marks;
}

}  // namespace sonar
