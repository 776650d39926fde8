// Building one tile of surface cells from the triangles that touch its cube. Pure: the same arguments give the same bytes.
#pragma once

#include <cstdint>
#include <span>

#include "core/base/units.hpp"
#include "core/scene/cells/surface_cells.hpp"
#include "core/scene/scene.hpp"

namespace sonar {

class TextureField;

/// Which lattice cube, of which patch: the triangles of one object that share material, dominant axis and side.
struct TileAddress {
  int object = 0, material = 0, axis = 0;
  bool negative_side = false;
  int level = 0;
  std::int32_t i = 0, j = 0, k = 0;  // cube index along u, v, w (cell_lattice.hpp)
};

/// Statistics of the cells' weights: complex Gaussian, or of one magnitude and random phase, by which few cells in a sample have
/// the statistics of many.
enum class CellWeights { gaussian, of_one_magnitude };

/// `data` stays null when no cell lies in the cube. `texture`, `grain`: null = none. Cost: about 20 ns a cell, with
/// either of them 60 more.
CellTile build_tile(const TileAddress& address, const Mesh& mesh, std::span<const std::uint32_t> triangles,
                    std::uint32_t texture_seed, Seed seed, const TextureField* texture = nullptr,
                    const TextureField* grain = nullptr, CellWeights weights = CellWeights::gaussian);

}  // namespace sonar
