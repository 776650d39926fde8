// A tile of surface cells, and the function that builds it from the triangles that touch its cube. Equal arguments give equal
// bytes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "core/base/geometry.hpp"
#include "core/base/units.hpp"
#include "core/scene/scene.hpp"

namespace sonar {

// The view of a ping on the surface cells: the bounds of its fan, and the size of cells at each range.

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
  float max_elevation_rad = 1;    // half angle of the fan about the array axis
  std::vector<CellLevel> levels;  // coarsest first
  // For fans with side lobes: half angle of the main part about the array axis, and the angle at which side lobes begin. In
  // side lobes, all cells of a cube have one level, at most `side_coarser` levels coarser than the coarsest of `levels`.
  float main_elevation_rad = 2, side_from_rad = 2;
  float side_area_per_range_m = 0;  // cell area divided by range at grazing incidence; larger at steep incidence
  int side_coarser = 0;
  // If true, objects with few cells get finer cells, because without speckle the positions of cells would be visible.
  bool exact_small = false;
  /// If set, it replaces the bounds of the fan. For a ball around a point in the sonar's axes it returns the distances at which
  /// the ball is visible; nullopt if it is not visible. Via mirrors, the distances are larger than the true distance.
  std::function<std::optional<DistanceSpan>(Vec3d from_sonar_m, double radius_m)> seen_between;
};

class TextureField;

/// Up to 16 x 16 cells (more where surfaces overlap) in a cube of the lattice, as int16 columns in one allocation.
/// Positions are relative to the cube's centre. Padding cells have zero weight.
struct CellTile {
  int object = 0, material = 0, axis = 0, level = 0;  // axis: dominant axis of the facet normals, 0 x, 1 y, 2 z
  Vec3d centre_m;                                     // object coordinates
  float half_edge_m = 0;                              // half an edge of the cube
  Vec3 box_middle_m, box_half_m;                      // the box around its cells, relative to the centre, object axes
  float position_unit_m = 0;
  float weight_unit = 0;           // xi * sqrt(cell area) [m] per count
  std::uint64_t weights_hash = 0;  // hash of the first block; shows that the memory of a tile was reused for another tile
  int count = 0;                   // padded to a multiple of CellTile::block
  int stride = 0;                  // int16 values per column
  std::unique_ptr<std::int16_t[]> data;

  static constexpr int block = 16;
  static constexpr float normal_unit = 1.0f / 32767.0f;
  enum Column { x, y, z, normal_x, normal_y, normal_z, weight_re, weight_im, columns };
  const std::int16_t* column(Column c) const { return data.get() + static_cast<std::ptrdiff_t>(c) * stride; }
  /// Position of a cell in the middle of the tile, relative to the cube's centre, in object axes. The cube's centre may lie off
  /// the surface.
  Vec3d middle_cell_m() const {
    const auto along = [this, unit = static_cast<double>(position_unit_m)](Column c) { return unit * column(c)[count / 2]; };
    return {along(x), along(y), along(z)};
  }
  std::size_t bytes() const { return static_cast<std::size_t>(stride) * columns * sizeof(std::int16_t); }
};

/// Identifies a lattice cube and its patch: the triangles of one object that share material, dominant axis and side.
struct TileAddress {
  int object = 0, material = 0, axis = 0;
  bool negative_side = false;
  int level = 0;
  std::int32_t i = 0, j = 0, k = 0;  // cube index along u, v, w (cell_lattice.hpp)
};

/// Statistics of the cells' weights: complex Gaussian, or constant magnitude with random phases. With constant magnitude, a few
/// cells per sample already have the statistics of many.
enum class CellWeights { gaussian, of_one_magnitude };

/// Builds a tile. `data` is null if no cell lies in the cube. `texture`, `grain`: null = none. Cost: about 20 ns per cell, plus
/// 60 ns for texture and 60 ns for grain.
CellTile build_tile(const TileAddress& address, const Mesh& mesh, std::span<const std::uint32_t> triangles,
                    std::uint32_t texture_seed, Seed seed, const TextureField* texture = nullptr,
                    const TextureField* grain = nullptr, CellWeights weights = CellWeights::gaussian);

}  // namespace sonar
