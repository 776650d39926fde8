// Draws all kinds of pictures that sonar_picture.hpp defines.
#pragma once

#include <utility>
#include <vector>

#include "core/image/draw_fan.hpp"
#include "core/image/sonar_picture.hpp"

namespace sonar {

/// Points of a sonar that looks down are drawn below it.
inline Opens opens_of(const SonarPicture& picture) {
  return picture.kind == PictureKind::points && picture.elevation_rad < 0 ? Opens::downwards : Opens::upwards;
}

/// Height of the picture in pixels, for the width in `style`. The picture must be one that PicturePainter accepts.
int picture_height(const SonarPicture& picture, const FanStyle& style);

/// Marks at equal steps of time before the newest ping; none if the ages of the rows are not known. Marks that would lie too
/// close to others, after a pause between pings, are left out.
std::vector<TimeMark> time_marks(const SonarPicture& waterfall);

/// Draws a series of pictures. If rings are on, it also draws the head direction of a sweep, and axes in pictures that are not
/// fans.
class PicturePainter {
 public:
  explicit PicturePainter(FanStyle style) : style_(style), fan_(std::move(style)) {}
  /// Draws the picture. Returns the same errors as draw_fan().
  Result<Raster> draw(const SonarPicture& picture);

 private:
  FanStyle style_;
  FanPainter fan_;
};

}  // namespace sonar
