// The parts of SurfaceCells: cubes of the lattice, and the trees of cubes over a patch of an object's surface.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <vector>

#include "core/scene/cells/cell_lattice.hpp"
#include "core/scene/cells/cell_tile.hpp"
#include "core/scene/scene.hpp"

namespace sonar {

struct Cube {
  double u, v, w, half;
  double radius() const { return half * 1.7320508075688772 * 1.0001; }  // radius of a ball around the cube
};
inline Cube cube_of(const TileAddress& a) {
  const double e = lattice::tile_edge_m(a.level);
  return {(a.i + 0.5) * e, (a.j + 0.5) * e, (a.k + 0.5) * e, e / 2};
}
inline bool may_touch(const lattice::FacetBounds& f, const Cube& c) { return lattice::may_touch(f, c.u, c.v, c.w, c.half); }

/// A cube of the lattice: the triangles that may own points in it, the tile of its level (built when needed), and its eight
/// child cubes.
struct CellNode {
  // The members that every visit reads come first, so that they are close in memory.
  TileAddress address;
  std::atomic<bool> divided = false;                      // true: other threads may use `children`
  bool built = false, side_built = false, alone = false;  // alone: made by SurfacePatch::raise(), without children
  std::atomic<std::uint64_t> last_visited = 0;
  std::array<std::unique_ptr<CellNode>, 8> children;  // null if a child has no triangles
  std::vector<std::uint32_t> triangles;
  CellTile tile, side_tile;  // side_tile: for side lobes

  std::size_t tile_bytes() const { return tile.bytes() + side_tile.bytes(); }
  std::size_t own_bytes() const { return sizeof(CellNode) + triangles.capacity() * sizeof(std::uint32_t) + tile_bytes(); }
  /// Drops the tiles. Returns the number of bytes freed.
  std::size_t forget_tiles() {
    const std::size_t bytes = tile_bytes();
    tile = CellTile{}, side_tile = CellTile{};
    built = side_built = false;
    return bytes;
  }
};

/// The triangles of one object that share material, dominant axis and side of the normal: one lattice.
class SurfacePatch {
 public:
  int object = 0, material = 0, axis = 0;
  bool negative_side = false;
  Texture texture, grain;  // those of the material; the tiles depend on them
  std::uint32_t texture_seed = 0;
  int coarsest = 0;  // coarsest level of the object's cells with exact_small
  std::shared_ptr<const Mesh> mesh;
  std::vector<std::unique_ptr<CellNode>> roots;
  std::size_t first_coarsest = 0;  // index of the first root with the coarsest level

  void set_material(const Material& m) { texture = m.texture, grain = m.grain, texture_seed = m.texture_seed; }
  bool has_tiles_of(const Material& m) const {
    return texture == m.texture && grain == m.grain && texture_seed == m.texture_seed;
  }
  /// Size of the mesh and of the roots without their tiles [bytes].
  std::size_t fixed_bytes() const;

  void plant(const std::vector<std::uint32_t>& triangles);
  static constexpr int finest_root = 4;  // level
  /// Adds roots that are one level coarser than the present coarsest ones, if those are finer than `level`. The new roots have
  /// only tiles; finer cubes belong to the first roots.
  void raise(int level);
  /// Makes the child cubes of `node`. Returns their size in bytes.
  std::size_t divide(CellNode& node) const;
  /// The level of cells for side lobes in a cube. The sonar is at `sonar_m` in the object's axes.
  int side_level(const TileAddress& cube, Vec3d sonar_m, const CellView& view) const;
  /// True if this cube provides the cells for side lobes: its level is fine enough, and no larger cube has a level that is fine
  /// enough.
  bool has_side_cells(const TileAddress& cube, Vec3d sonar_m, const CellView& view) const;
  /// Drops the tiles and keeps the cubes. Returns the number of bytes freed.
  std::size_t forget_tiles();
  /// Drops the children of each cube, from `node` down, if all of them were last visited before `then`. Returns the bytes freed.
  static std::size_t forget_below(CellNode& node, std::uint64_t then);
};

}  // namespace sonar
