// Outlines of regions of a picture, along the edges of its pixels: polygons of labels.
#pragma once

#include <functional>
#include <vector>

namespace sonar {

/// A corner between pixels: pixel (x, y) lies between the corners (x, y) and (x + 1, y + 1).
struct Corner {
  int x = 0, y = 0;
  bool operator==(const Corner&) const = default;
};
using Outline = std::vector<Corner>;  // clockwise as seen, y downwards; corners where it turns

/// Outlines of the regions of edge-joined pixels of [x0, x1) by [y0, y1) that `is_in` names, without holes, in
/// the order of their first pixels, row by row.
std::vector<Outline> outlines(int x0, int y0, int x1, int y1, const std::function<bool(int x, int y)>& is_in);

}  // namespace sonar
