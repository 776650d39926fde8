// Draws pictures of sonars for people (sonar_picture.hpp), for every kind of picture.
#pragma once

#include <utility>

#include "core/image/draw_fan.hpp"
#include "core/image/sonar_picture.hpp"

namespace sonar {

/// Multibeams, whose pictures are points, look down.
inline Opens opens_of(const SonarPicture& picture) {
  return picture.kind == PictureKind::points ? Opens::downwards : Opens::upwards;
}

/// Height of the picture in pixels, for the width in `style`. PicturePainter must accept the picture.
int picture_height(const SonarPicture& picture, const FanStyle& style);

/// Draws one picture after another. With rings it also draws the head of a sweep, or axes in pictures that are not fans.
class PicturePainter {
 public:
  explicit PicturePainter(FanStyle style) : style_(style), fan_(std::move(style)) {}
  /// The errors are those of draw_fan.
  Result<Raster> draw(const SonarPicture& picture);

 private:
  FanStyle style_;
  FanPainter fan_;
};

}  // namespace sonar
