// Compares the cells of a tile with a simple implementation: point by point, with functions of the standard library and a sort.
#include "core/scene/cells/cell_tile.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/base/random.hpp"
#include "core/scene/cells/cell_lattice.hpp"
#include "core/scene/cells/texture.hpp"

namespace sonar {
namespace {

constexpr int side = 16;                        // cells along a tile
constexpr std::uint32_t block_key = 0x6e6574u;  // separates the draws of blocks from those of cells

struct LatticePoint {
  double u, v;
  std::uint32_t speckle_a, speckle_b;
};

struct Cell {
  std::uint32_t order;  // order by 4 x 4 sub-squares: sixteen neighbours in memory are neighbours in space
  Vec3d from_centre;
  Vec3d normal;
  float re, im;
};

/// Returns the quarter of a cell in which its point lies, along one axis of a 4 x 4 block, from the position of the cell in the
/// block. Random bits that depend on the digits before it flip each of its two binary digits (nested scrambling).
int quarter_of(int along, std::uint32_t scramble) {
  const auto bit = [&](int i) { return static_cast<int>(scramble >> i & 1u); };
  const int half = (along & 1) ^ bit(along >> 1);
  return 2 * half + ((along >> 1) ^ bit(2 + half));
}

/// One draw of a lattice cell gives four numbers: two for the position of its point, two for its speckle. The points of a block
/// of 4 x 4 cells form a scrambled digital net: each of the sixteen strips of any shape from 1/16 x 1 to 1 x 1/16 contains one
/// point. So the echo of an interval of range depends little on the draw. Each point by itself is uniform in its cell.
std::array<LatticePoint, side * side> draw_points(const TileAddress& a, std::uint32_t texture_seed, Seed seed) {
  std::array<LatticePoint, side * side> points;
  const double s = lattice::cell_size_m(a.level);
  const auto bits = static_cast<std::uint64_t>(seed);
  const std::uint32_t patch = static_cast<std::uint32_t>(a.object) * 8u + static_cast<std::uint32_t>(a.axis) * 2u +
                              static_cast<std::uint32_t>(a.negative_side);
  const auto draw_at = [&](std::int32_t i, std::int32_t j, std::uint32_t key) {
    return philox(patch, static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(j), static_cast<std::uint32_t>(a.level),
                  static_cast<std::uint32_t>(bits) ^ key, static_cast<std::uint32_t>(bits >> 32) ^ texture_seed);
  };
  std::array<Random4, (side / 4) * (side / 4)> blocks;
  for (int b = 0; b < static_cast<int>(blocks.size()); ++b)
    blocks[static_cast<std::size_t>(b)] =
        draw_at(a.i * (side / 4) + b % (side / 4), a.j * (side / 4) + b / (side / 4), block_key);
  for (int row = 0; row < side; ++row)
    for (int col = 0; col < side; ++col) {
      const std::int32_t i = a.i * side + col, j = a.j * side + row;
      const Random4 draw = draw_at(i, j, 0);
      const Random4& block = blocks[static_cast<std::size_t>(row / 4 * (side / 4) + col / 4)];
      const int quarter_u = quarter_of(row % 4, block.v[0] >> 4 * (col % 4)),
                quarter_v = quarter_of(col % 4, block.v[1] >> 4 * (row % 4));
      points[static_cast<std::size_t>(row * side + col)] = {
          (i + 0.25 * (quarter_u + static_cast<double>(uniform_open(draw.v[0])))) * s,
          (j + 0.25 * (quarter_v + static_cast<double>(uniform_open(draw.v[1])))) * s, draw.v[2], draw.v[3]};
    }
  return points;
}

constexpr std::uint32_t sub_square_order(int row, int col) {
  return static_cast<std::uint32_t>((row / 4) * 64 + (col / 4) * 16 + (row % 4) * 4 + col % 4);
}

/// Columns (or rows) of the lattice in this tile that an interval of the plane can reach.
struct CellRange {
  int from, to;
};
CellRange cells_between(double lo, double hi, double s, std::int32_t tile) {
  const double first = static_cast<double>(tile) * side;
  const double from = std::floor(lo / s) - first, to = std::floor(hi / s) - first;
  return {static_cast<int>(std::clamp(from, 0.0, double{side})), static_cast<int>(std::clamp(to, -1.0, double{side - 1}))};
}

void add_cells(const lattice::Facet& f, const TileAddress& a, Vec3d centre, const std::array<LatticePoint, side * side>& points,
               std::optional<TexturePatch>& patch, std::vector<Cell>& cells) {
  const double s = lattice::cell_size_m(a.level), edge = lattice::tile_edge_m(a.level);
  const auto [u_lo, u_hi] = std::minmax({f.u[0], f.u[1], f.u[2]});
  const auto [v_lo, v_hi] = std::minmax({f.v[0], f.v[1], f.v[2]});
  const CellRange cols = cells_between(u_lo, u_hi, s, a.i), rows = cells_between(v_lo, v_hi, s, a.j);
  const Vec3d normal = lattice::from_permuted(f.nu, f.nv, f.nw, a.axis);
  const double root_area = s / std::sqrt(std::abs(f.nw));
  for (int row = rows.from; row <= rows.to; ++row)
    for (int col = cols.from; col <= cols.to; ++col) {
      const LatticePoint& p = points[static_cast<std::size_t>(row * side + col)];
      if (!lattice::owns(f, p.u, p.v)) continue;
      const double w = lattice::height(f, p.u, p.v);
      if (std::floor(w / edge) != static_cast<double>(a.k)) continue;
      const ComplexNormal xi = complex_normal(p.speckle_a, p.speckle_b);
      const Vec3d place = lattice::from_permuted(p.u, p.v, w, a.axis);
      const double root = patch ? root_area * static_cast<double>(patch->root_at(place)) : root_area;
      cells.push_back({sub_square_order(row, col), place - centre, normal, static_cast<float>(xi.re * root),
                       static_cast<float>(xi.im * root)});
    }
}

std::int16_t counts(double value) { return static_cast<std::int16_t>(std::lround(std::clamp(value, -32767.0, 32767.0))); }

void pack(const std::vector<Cell>& cells, CellTile& tile) {
  float peak = 0;
  for (const Cell& c : cells) peak = std::max({peak, std::abs(c.re), std::abs(c.im)});
  tile.weight_unit = peak > 0 ? peak / 32767.0f : 1.0f;
  const int n = static_cast<int>(cells.size());
  tile.count = (n + CellTile::block - 1) / CellTile::block * CellTile::block;
  tile.stride = tile.count;
  tile.data = std::make_unique<std::int16_t[]>(static_cast<std::size_t>(tile.stride) * CellTile::columns);
  Vec3d low = cells.front().from_centre, high = low;
  for (const Cell& c : cells) {
    const Vec3d p = c.from_centre;
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }
  const double rounding = static_cast<double>(tile.position_unit_m);
  tile.box_middle_m = to_float(0.5 * (low + high));
  tile.box_half_m = to_float(0.5 * (high - low) + Vec3d{rounding, rounding, rounding});
  const auto put = [&](CellTile::Column c, int i, std::int16_t v) {
    tile.data[static_cast<std::size_t>(c * tile.stride + i)] = v;
  };
  for (int i = 0; i < tile.count; ++i) {
    const Cell& c = cells[static_cast<std::size_t>(std::min(i, n - 1))];  // padding repeats the last position with zero weight
    put(CellTile::x, i, counts(c.from_centre.x / tile.position_unit_m));
    put(CellTile::y, i, counts(c.from_centre.y / tile.position_unit_m));
    put(CellTile::z, i, counts(c.from_centre.z / tile.position_unit_m));
    put(CellTile::normal_x, i, counts(c.normal.x * 32767));
    put(CellTile::normal_y, i, counts(c.normal.y * 32767));
    put(CellTile::normal_z, i, counts(c.normal.z * 32767));
    put(CellTile::weight_re, i, i < n ? counts(c.re / tile.weight_unit) : std::int16_t{0});
    put(CellTile::weight_im, i, i < n ? counts(c.im / tile.weight_unit) : std::int16_t{0});
  }
}

CellTile built_plainly(const TileAddress& a, const Mesh& mesh, std::span<const std::uint32_t> triangles,
                       std::uint32_t texture_seed, Seed seed, const TextureField* texture) {
  const double edge = lattice::tile_edge_m(a.level);
  CellTile tile;
  tile.object = a.object;
  tile.material = a.material;
  tile.axis = a.axis;
  tile.level = a.level;
  tile.centre_m = lattice::from_permuted((a.i + 0.5) * edge, (a.j + 0.5) * edge, (a.k + 0.5) * edge, a.axis);
  tile.half_edge_m = static_cast<float>(edge / 2);
  tile.position_unit_m = static_cast<float>(edge / 2 / 32700.0);

  const auto points = draw_points(a, texture_seed, seed);
  std::vector<Cell> cells;
  cells.reserve(side * side);
  std::optional<TexturePatch> patch;
  if (texture) patch.emplace(*texture, a.object);
  for (const std::uint32_t t : triangles) add_cells(lattice::facet_of(mesh, t, a.axis), a, tile.centre_m, points, patch, cells);
  if (cells.empty()) return tile;
  std::stable_sort(cells.begin(), cells.end(), [](const Cell& p, const Cell& q) { return p.order < q.order; });
  pack(cells, tile);
  return tile;
}

/// Returns all triangles whose normals have the axis as their largest component, on the side that the address names.
std::vector<std::uint32_t> of_patch(const Mesh& mesh, const TileAddress& a) {
  std::vector<std::uint32_t> triangles;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    const Vec3d n = lattice::normal_of(mesh, t);
    const double along = a.axis == 0 ? n.x : a.axis == 1 ? n.y : n.z;
    if (lattice::dominant_axis(n) == a.axis && along != 0 && (along < 0) == a.negative_side) triangles.push_back(t);
  }
  return triangles;
}

struct Compared {
  int tiles = 0, cells = 0, different_weights = 0;
};

void expect_the_same(const CellTile& found, const CellTile& expected, Compared& sum) {
  ASSERT_EQ(found.count, expected.count);
  ASSERT_EQ(found.stride, expected.stride);
  ASSERT_EQ(found.data == nullptr, expected.data == nullptr);
  if (!expected.data) return;
  ++sum.tiles;
  sum.cells += found.count;
  EXPECT_EQ(found.position_unit_m, expected.position_unit_m);
  EXPECT_NEAR(found.weight_unit / expected.weight_unit, 1, 1e-6);
  const auto same = [](Vec3 a, Vec3 b) { return a.x == b.x && a.y == b.y && a.z == b.z; };
  EXPECT_TRUE(same(found.box_middle_m, expected.box_middle_m));
  EXPECT_TRUE(same(found.box_half_m, expected.box_half_m));
  for (int c = 0; c < CellTile::columns; ++c) {
    const auto column = static_cast<CellTile::Column>(c);
    const bool weight = column == CellTile::weight_re || column == CellTile::weight_im;
    for (int i = 0; i < found.count; ++i) {
      const int off = std::abs(found.column(column)[i] - expected.column(column)[i]);
      ASSERT_LE(off, weight ? 1 : 0) << "column " << c << ", cell " << i;
      sum.different_weights += off;
    }
  }
}

/// Compares all tiles of one patch with indices from -reach to reach.
void compare(const Mesh& mesh, TileAddress a, int reach, const TextureField* texture, Compared& sum) {
  const std::vector<std::uint32_t> triangles = of_patch(mesh, a);
  for (a.i = -reach; a.i <= reach; ++a.i)
    for (a.j = -reach; a.j <= reach; ++a.j)
      for (a.k = -reach; a.k <= reach; ++a.k) {
        const Seed seed{0x123456789abcdefull + static_cast<std::uint64_t>(a.level)};
        expect_the_same(build_tile(a, mesh, triangles, 77, seed, texture), built_plainly(a, mesh, triangles, 77, seed, texture),
                        sum);
        if (testing::Test::HasFatalFailure()) FAIL() << "tile " << a.i << ' ' << a.j << ' ' << a.k;
      }
}

/// Triangles in all directions about the origin. Some are small, some cross the whole cube of side 2.
Mesh heap(std::uint32_t count, std::uint32_t seed) {
  Mesh mesh;
  for (std::uint32_t t = 0; t < count; ++t) {
    const float size = t % 3 == 0 ? 2.0f : 0.25f;
    Vec3 at[4];
    for (std::uint32_t c = 0; c < 4; ++c) {
      const Random4 d = philox(t, c, 0, 0, seed, 0);
      at[c] = {2 * uniform_open(d.v[0]) - 1, 2 * uniform_open(d.v[1]) - 1, 2 * uniform_open(d.v[2]) - 1};
    }
    for (std::uint32_t c = 0; c < 3; ++c) mesh.vertices.push_back(at[3] + size * at[c]);
    mesh.triangles.push_back({3 * t, 3 * t + 1, 3 * t + 2});
  }
  mesh.material.assign(count, 0);
  return mesh;
}

TEST(CellTile, EqualsATileMadePointByPointForEveryAxisSideAndSize) {
  const Mesh mesh = heap(240, 4);
  for (int axis = 0; axis < 3; ++axis)
    for (const bool negative : {false, true})
      for (const int level : {3, 5}) {
        Compared sum;
        compare(mesh, {.object = 3, .axis = axis, .negative_side = negative, .level = level}, level == 3 ? 1 : 3, nullptr, sum);
        EXPECT_GT(sum.tiles, level == 3 ? 8 : 50);
        EXPECT_LT(sum.different_weights, 0.01 * sum.cells);
      }
}

TEST(CellTile, EqualsATileMadePointByPointWithTexture) {
  const TextureField texture({.shape = 0.7f, .correlation_m = 0.2f}, 9, Seed{2});
  Compared sum;
  compare(heap(40, 6), {.axis = 2, .level = 4}, 1, &texture, sum);
  EXPECT_GT(sum.cells, 500);
}

// Two patches in one cube own the same points. So do two copies of one triangle; then the earlier copy comes first.
TEST(CellTile, PointsWithSeveralSurfacesKeepTheirOrder) {
  Mesh mesh;
  for (const float z : {0.1f, 0.3f, 0.1f}) {
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    mesh.vertices.insert(mesh.vertices.end(), {{-3, -3, z}, {3, -3, z + 0.02f}, {-3, 3, z}, {3, 3, z}});
    mesh.triangles.push_back({first, first + 1, first + 2});
    mesh.triangles.push_back({first + 1, first + 3, first + 2});
  }
  mesh.material.assign(mesh.triangles.size(), 0);
  Compared sum;
  compare(mesh, {.axis = 2, .level = 5}, 1, nullptr, sum);
  EXPECT_EQ(sum.tiles, 9);
  EXPECT_EQ(sum.cells, 9 * 3 * 256);
}

// Lattice points of a grid of squares whose edges run along cell borders, at every level.
TEST(CellTile, EqualsATileMadePointByPointOnATerrain) {
  Mesh mesh;
  constexpr std::uint32_t n = 12;
  for (std::uint32_t j = 0; j <= n; ++j)
    for (std::uint32_t i = 0; i <= n; ++i) {
      const float x = 0.25f * static_cast<float>(i) - 1.5f, y = 0.25f * static_cast<float>(j) - 1.5f;
      mesh.vertices.push_back({x, y, 0.2f * std::sin(3 * x) * std::cos(2 * y)});
    }
  for (std::uint32_t j = 0; j < n; ++j)
    for (std::uint32_t i = 0; i < n; ++i) {
      const std::uint32_t a = j * (n + 1) + i, c = a + n + 1;
      mesh.triangles.push_back({a, a + 1, c + 1});
      mesh.triangles.push_back({a, c + 1, c});
    }
  mesh.material.assign(mesh.triangles.size(), 0);
  for (int level = 2; level <= 6; ++level) {
    Compared sum;
    compare(mesh, {.axis = 2, .level = level}, 2, nullptr, sum);
    EXPECT_GT(sum.cells, 100) << level;
  }
}

// The digest is the same on every processor: with AVX-512, with AVX2, with neither, and with sanitizers, where only one form is
// compiled.
TEST(CellTile, BytesDoNotDependOnTheInstructionSet) {
  const Mesh mesh = heap(120, 8);
  std::uint64_t digest = 0xcbf29ce484222325u;
  const auto take = [&](std::uint32_t x) { digest = (digest ^ x) * 0x100000001b3u; };
  int cells = 0;
  TileAddress a{.object = 1, .axis = 1, .level = 5};
  const std::vector<std::uint32_t> triangles = of_patch(mesh, a);
  for (a.i = -3; a.i <= 3; ++a.i)
    for (a.j = -3; a.j <= 3; ++a.j)
      for (a.k = -3; a.k <= 3; ++a.k) {
        const CellTile tile = build_tile(a, mesh, triangles, 1, Seed{7});
        cells += tile.count;
        take(std::bit_cast<std::uint32_t>(tile.weight_unit));
        for (int n = 0; n < tile.count * CellTile::columns; ++n)
          take(static_cast<std::uint16_t>(tile.data[static_cast<std::size_t>(n)]));
      }
  EXPECT_GT(cells, 1000);
  EXPECT_EQ(digest, 7953874126091771048u);
}

}  // namespace
}  // namespace sonar
