// Draws every kind of sonar_picture.hpp.
#pragma once

#include <utility>

#include "core/image/draw_fan.hpp"
#include "core/image/sonar_picture.hpp"

namespace sonar {

/// Pictures of points are those of multibeam echo sounders, which look down.
inline Opens opens_of(const SonarPicture& picture) {
  return picture.kind == PictureKind::points ? Opens::downwards : Opens::upwards;
}

/// Height of the picture in pixels, for the width in `style`. PicturePainter must accept the picture.
int picture_height(const SonarPicture& picture, const FanStyle& style);

/// Draws a series of pictures. If rings are on, it also draws the head direction of a sweep, and axes in pictures that are not
/// fans.
class PicturePainter {
 public:
  explicit PicturePainter(FanStyle style) : style_(style), fan_(std::move(style)) {}
  /// Errors: as draw_fan.
  Result<Raster> draw(const SonarPicture& picture);

 private:
  FanStyle style_;
  FanPainter fan_;
};

}  // namespace sonar
