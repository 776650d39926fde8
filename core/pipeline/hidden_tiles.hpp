// Finds the tiles that a ping can skip, from the boxes around their cells. This happens before any cell is loaded. A tile is
// skipped only if simd/cells.inl would drop all of its cells, so echoes do not change.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/pipeline/ping_context.hpp"
#include "core/pipeline/signals.hpp"
#include "core/pipeline/simd/kernels.hpp"

namespace sonar {

/// A tile with its constants for this ping, and the columns and bins that its cells can reach.
struct PreparedTile {
  simd::TileSeen seen;
  int first_column = 0, last_column = 0;  // half-open; empty if no cell is in view
  // First and last bin of the depth map with which its cells are compared.
  int first_bin = 0, last_bin = 0;
  float nearest = 0;  // all cells are hidden if the 1 / x of the map exceeds this [1/m]; infinity: unknown
};

/// Finds the columns and bins that the cells of a prepared tile can reach. `sonar_from_object` and `from_sonar_m` are the
/// rotation and the position of the tile's centre in the axes of reception; `seen_from_object` and `seen_from_sonar_m` are the
/// same in the axes in which rays are traced.
void find_reach(const PingContext& context, const Rotation& sonar_from_object, Vec3d from_sonar_m,
                const Rotation& seen_from_object, Vec3d seen_from_sonar_m, PreparedTile& tile);

/// The farthest hit in each block of a depth map.
class FarthestSeen {
 public:
  void shape(const DepthMap& map);
  /// Lists the tiles of `wanted` that may have visible cells in the columns of the group, in the same order.
  void leave_out_hidden(const std::vector<PreparedTile>& tiles, std::span<const std::uint32_t> wanted,
                        const simd::GroupView& group, std::vector<std::uint32_t>& in_sight) const;

 private:
  /// True if the map hides every cell of the tile in columns [first, last). `beside`: GroupView::columns_beside.
  bool hides(const PreparedTile& tile, int first, int last, int beside) const;

  static constexpr int columns_a_block = 4, bins_a_block = 16;
  int first_column_ = 0, end_column_ = 0, blocks_ = 0;  // blocks along the bins
  std::vector<float> least_;                            // smallest 1 / x, [blocks of columns][blocks of bins]
  std::vector<float> line_;
};

}  // namespace sonar
