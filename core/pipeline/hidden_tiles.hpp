// Which tiles of surface cells a ping need not look at: boxes round their cells tell before any cell is fetched. A tile is left
// out only where each of its cells would be dropped by simd/cells.inl, so that no echo changes.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/pipeline/ping_context.hpp"
#include "core/pipeline/signals.hpp"
#include "core/pipeline/simd/kernels.hpp"
#include "core/scene/cells/surface_cells.hpp"

namespace sonar {

/// A tile with this ping's constants, and what its cells can reach.
struct PreparedTile {
  simd::TileSeen seen;
  int first_column = 0, last_column = 0;  // half-open; none where no cell is in view
  // Bins of the depth map that its cells are compared with, both included.
  int first_bin = 0, last_bin = 0;
  float nearest = 0;  // the map hides all cells where its 1 / x is larger than this [1/m]; infinity: it cannot tell
};

/// Finds what the cells of a prepared tile can reach. `sonar_from_object`, `from_sonar_m`: the tile's centre in the axes of
/// reception; `seen_from_object`, `seen_from_sonar_m`: in those that the rays are traced in.
void find_reach(const PingContext& context, const Rotation& sonar_from_object, Vec3d from_sonar_m,
                const Rotation& seen_from_object, Vec3d seen_from_sonar_m, PreparedTile& tile);

/// The farthest places of blocks of a depth map.
class FarthestSeen {
 public:
  void shape(const DepthMap& map);
  /// Keeps the wanted tiles of which the map may show cells in the columns of the group, in order.
  void leave_out_hidden(const std::vector<PreparedTile>& tiles, std::span<const std::uint32_t> wanted,
                        const simd::GroupView& group, std::vector<std::uint32_t>& in_sight) const;

 private:
  /// The map hides every cell of the tile in columns [first, last). `beside`: GroupView::columns_beside.
  bool hides(const PreparedTile& tile, int first, int last, int beside) const;

  static constexpr int columns_a_block = 4, bins_a_block = 16;
  int first_column_ = 0, end_column_ = 0, blocks_ = 0;  // blocks along the bins
  std::vector<float> least_;                            // smallest 1 / x of each block, [columns][bins]
  std::vector<float> line_;
};

}  // namespace sonar
