// Draws the picture of a sonar for people (sonar_picture.hpp), of any kind.
#pragma once

#include <utility>

#include "core/image/draw_fan.hpp"
#include "core/image/sonar_picture.hpp"

namespace sonar {

/// Pixels that the picture is high when drawn so wide. Of one that PicturePainter does not refuse.
int picture_height(const SonarPicture& picture, const FanStyle& style);

/// Draws one picture after another. With rings also the head of a sweep and the axes of what is no fan.
class PicturePainter {
 public:
  explicit PicturePainter(FanStyle style) : style_(style), fan_(std::move(style)) {}
  /// Refuses what draw_fan refuses.
  Result<Raster> draw(const SonarPicture& picture);

 private:
  FanStyle style_;
  FanPainter fan_;
};

}  // namespace sonar
