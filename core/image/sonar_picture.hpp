// The picture that viewers show of a sonar. For most products it is a fan of the last ping; for others it is made of several
// pings. protocol/<vendor>/host.cpp makes the picture. PicturePainter (draw_picture.hpp) draws it for `sonarctl view`, the live
// view and other viewers.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

namespace sonar {

// The samples of a decoded ping of any make, by row (range) and beam, with the direction of each beam. draw_fan draws them;
// image_statistics measures them.

/// Options that convert linear samples with a large range of values to brightness. Makes with such samples set them.
struct Shades {
  std::size_t per_mille = 999;  // thousandths of the samples that are within the colour map; brighter samples saturate
  float gamma = 1;              // brightness is (code / full scale)^gamma
};

struct PolarImage {
  std::size_t rows = 0, beams = 0;
  double row_spacing_m = 0;         // row i covers start_m + [i, i + 1) * row_spacing_m
  std::vector<double> azimuth_rad;  // [beams], positive to port, strictly falling
  std::vector<float> samples;       // [rows][beams], codes as sent; below 0 (only in a waterfall): not measured
  float full_scale = 255;           // the code with the brightest colour
  double start_m = 0;               // range at which the samples begin
  Shades shades = {};

  float at(std::size_t row, std::size_t beam) const { return samples[row * beams + beam]; }
  /// Returns the code that `per_mille` of a thousand samples do not exceed, at least 1.
  float brightest(std::size_t per_mille) const {
    std::vector<float> codes = samples;
    const auto place = codes.begin() + static_cast<std::ptrdiff_t>((codes.size() - 1) * per_mille / 1000);
    std::nth_element(codes.begin(), place, codes.end());
    return std::max(1.0f, *place);
  }
  void shade(const Shades& of_make) {
    full_scale = brightest(of_make.per_mille);
    shades = of_make;
  }
  /// Returns the brightness of a code: 1 at full scale, where the colour map ends.
  float brightness(float code) const {
    const float part = code / full_scale;
    return shades.gamma == 1 ? part : std::pow(std::max(0.0f, part), shades.gamma);
  }
  double range_m() const { return start_m + static_cast<double>(rows) * row_spacing_m; }
};

enum class PictureKind {
  fan,          // the last ping, by bearing and range
  points,       // points by bearing and range, drawn on a fan
  sweep,        // a fan or a full circle that a rotating head scans beam by beam
  range_image,  // a pixel for each azimuth and elevation; near pixels are bright
  waterfall,    // one beam over time: a row for each ping, the newest on top; a column for each range
};
inline constexpr std::array<std::string_view, 5> picture_kind_names = {"fan", "points", "sweep", "range image", "waterfall"};
inline constexpr std::string_view name_of(PictureKind kind) { return picture_kind_names[static_cast<std::size_t>(kind)]; }

struct SonarPicture {
  PictureKind kind = PictureKind::fan;
  /// A range image has a row for each elevation, the highest first. A waterfall has no bearings; it has a row for each ping and
  /// a column for each range, `row_spacing_m` apart, beginning at `start_m`.
  PolarImage image;
  double head_rad = 0;                 // sweep: direction of the head, positive to port
  double elevation_rad = 0;            // elevation of a range image's top row (bottom row: its negative), or of the fan of points
  std::vector<double> row_age_s = {};  // waterfall: time from the ping of each row to the newest; empty: not known
  std::vector<std::pair<double, double>> points = {};             // points: azimuth, range
  enum class Column { none, sent, model } column = Column::none;  // points: content of `image`; none: `image` is empty
  std::optional<std::size_t> detections = {};  // number of them in the newest ping; nullopt: its messages have only samples

  bool is_polar() const { return kind == PictureKind::fan || kind == PictureKind::points || kind == PictureKind::sweep; }
  bool nothing_detected() const { return detections == std::size_t{0}; }
  /// Far end of the shown ranges [m].
  double range_m() const {
    return kind == PictureKind::waterfall ? image.start_m + static_cast<double>(image.beams) * image.row_spacing_m
                                          : image.range_m();
  }
};

/// A time beside a waterfall (time_marks() in draw_picture.hpp).
struct TimeMark {
  double part = 0;   // distance from the upper edge, divided by the height of the picture
  double age_s = 0;  // before the newest ping
};

/// Largest number of rows of a waterfall, and smallest number of rows in its picture. Rows without a ping are empty.
inline constexpr std::size_t waterfall_rows = 300, waterfall_fewest_rows = 100;

}  // namespace sonar
