// The view of a ping upon the surface cells: the bounds of its fan, and the size of the cells by range.
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "core/base/geometry.hpp"

namespace sonar {

/// Ranges in which the cells of one level (size 2^-level m) are used; neighbours cross-fade (weights add to one in power).
struct CellLevel {
  int level = 0;
  float fade_in_from_m = 0, full_from_m = 0, full_to_m = 0, fade_out_to_m = 0;
};

struct DistanceSpan {
  double nearest_m = 0, farthest_m = 0;
};

/// Outer bounds of a ping's view, in the sonar's frame.
struct CellView {
  Pose sonar_in_world;
  std::span<const Pose> bodies_in_world;
  float min_range_m = 0, max_range_m = 0;
  float max_sine = 1;             // |y / r| of the outermost column
  float max_elevation_rad = 1;    // half angle of the fan about the array axis
  std::vector<CellLevel> levels;  // coarsest first
  // Fans with side lobes: the main part, about the array axis, and where the rest begins. Cells of a whole cube there have one
  // level, and beyond `side_coarser` levels above the coarsest of `levels` they are no coarser.
  float main_elevation_rad = 2, side_from_rad = 2;
  float side_area_per_range_m = 0;  // area of a cell on a surface that is grazed, over its range; a steep one has larger cells
  int side_coarser = 0;
  bool exact_small = false;  // objects of few cells get finer ones: where no speckle hides which place each has
  /// When set, stands for the bounds of the fan: between which distances a ball about a place in the sonar's axes is seen, which
  /// mirrors can make farther than it is; nothing when it is not.
  std::function<std::optional<DistanceSpan>(Vec3d from_sonar_m, double radius_m)> seen_between;
};

}  // namespace sonar
