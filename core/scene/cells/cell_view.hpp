// The view of a ping on the surface cells: the bounds of its fan, and the size of cells at each range.
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "core/base/geometry.hpp"

namespace sonar {

/// Ranges in which the cells of one level (size 2^-level m) are used. Neighbouring levels cross-fade: their weights add to one
/// in power.
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
  float max_elevation_rad = 1;    // half angle of the fan, measured from the array axis
  std::vector<CellLevel> levels;  // coarsest first
  // For fans with side lobes: half angle of the main part about the array axis, and the angle at which side lobes begin. In
  // side lobes, all cells of a cube have one level, at most `side_coarser` levels coarser than the coarsest of `levels`.
  float main_elevation_rad = 2, side_from_rad = 2;
  float side_area_per_range_m = 0;  // cell area divided by range at grazing incidence; larger at steep incidence
  int side_coarser = 0;
  // Objects with few cells get finer ones, because without speckle the positions of cells would be visible.
  bool exact_small = false;
  /// If set, it replaces the bounds of the fan. For a ball around a point in the sonar's axes it returns the distances at which
  /// the ball is visible; nullopt if it is not visible. Via mirrors, the distances are larger than the true one.
  std::function<std::optional<DistanceSpan>(Vec3d from_sonar_m, double radius_m)> seen_between;
};

}  // namespace sonar
