// Computes outlines of regions of a picture, along the edges of pixels. They become polygons of labels.
#pragma once

#include <functional>
#include <vector>

namespace sonar {

/// A corner between pixels: pixel (x, y) lies between the corners (x, y) and (x + 1, y + 1).
struct Corner {
  int x = 0, y = 0;
  bool operator==(const Corner&) const = default;
};
using Outline = std::vector<Corner>;  // clockwise on the screen (y downwards); only corners where the direction changes

/// Outlines of the connected regions (by shared edges) of pixels in [x0, x1) by [y0, y1) for which `is_in` is true. Holes are
/// ignored. The regions are ordered by their first pixels, row by row.
std::vector<Outline> outlines(int x0, int y0, int x1, int y1, const std::function<bool(int x, int y)>& is_in);

}  // namespace sonar
