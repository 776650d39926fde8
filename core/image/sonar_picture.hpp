// The picture that viewers show of a sonar. For most products it is a fan of the last ping; for others it is made of several
// pings. protocol/<vendor>/host.cpp makes the picture. PicturePainter (draw_picture.hpp) draws it for `sonarctl view`, the live
// view and other viewers.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>
#include <utility>
#include <vector>

#include "core/image/polar_image.hpp"

namespace sonar {

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
  double head_rad = 0;       // sweep: direction of the head, positive to port
  double elevation_rad = 0;  // range image: elevation of the highest row; the lowest row has the negative value
  std::vector<std::pair<double, double>> points = {};             // points: azimuth, range
  enum class Column { none, sent, model } column = Column::none;  // points: content of `image`; none: `image` is empty

  bool is_polar() const { return kind == PictureKind::fan || kind == PictureKind::points || kind == PictureKind::sweep; }
  /// Far end of the shown ranges [m].
  double range_m() const {
    return kind == PictureKind::waterfall ? image.start_m + static_cast<double>(image.beams) * image.row_spacing_m
                                          : image.range_m();
  }
};

/// Largest number of rows of a waterfall, and smallest number of rows in its picture. Rows without a ping are empty.
inline constexpr std::size_t waterfall_rows = 300, waterfall_fewest_rows = 100;

}  // namespace sonar
