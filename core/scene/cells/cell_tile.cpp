#include "core/scene/cells/cell_tile.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>

#include "core/scene/cells/cell_lanes.hpp"
#include "core/scene/cells/cell_lattice.hpp"
#include "core/scene/cells/texture.hpp"

namespace sonar {
namespace {

using cell_lanes::side;

/// Values that are the same for all cells of one facet.
struct FacetOfCells {
  std::int16_t normal[3];  // x, y, z, in CellTile::normal_unit
  double root_area;
};

struct OwnedAgain {
  std::int32_t point, facet;
  double w;
};

/// The points of one cube that facets own.
struct Ownership {
  cell_lanes::Points points;
  cell_lanes::Owners first;       // the first facet that owns each point
  std::vector<OwnedAgain> again;  // further owners, in the order of the facets
  std::vector<FacetOfCells> facets;
};

/// The tile's lattice columns (or rows) that overlap an interval of the plane.
struct CellRange {
  int from, to;
};
CellRange cells_between(double lo, double hi, double s, std::int32_t tile) {
  const double first = static_cast<double>(tile) * side;
  const double from = std::floor(lo / s) - first, to = std::floor(hi / s) - first;
  return {static_cast<int>(std::clamp(from, 0.0, double{side})), static_cast<int>(std::clamp(to, -1.0, double{side - 1}))};
}

std::int16_t normal_counts(double value) {
  return static_cast<std::int16_t>(std::lround(std::clamp(value * 32767, -32767.0, 32767.0)));
}

/// Prepares the tests lattice::owns and lattice::height: computes all values that do not depend on the point.
cell_lanes::FacetTest test_of(const lattice::Facet& f, const TileAddress& a, CellRange cols, CellRange rows) {
  const double s = lattice::cell_size_m(a.level), edge = lattice::tile_edge_m(a.level), turn = f.nw > 0 ? 1.0 : -1.0;
  const auto border = [&](std::int32_t tile, int cell) { return (static_cast<double>(tile) * side + cell) * s; };
  cell_lanes::FacetTest t{};
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3;
    const bool forward = f.u[i] < f.u[j] || (f.u[i] == f.u[j] && f.v[i] < f.v[j]);
    const int p = forward ? i : j, q = forward ? j : i;
    const double sign = forward ? turn : -turn;
    const double du = turn * (f.u[j] - f.u[i]), dv = turn * (f.v[j] - f.v[i]);
    const bool with_its_points = dv < 0 || (dv == 0 && du > 0);
    // An area is zero or far above the smallest normal number, because coordinates are in single precision.
    t.edge[i] = {f.u[p], f.v[p], sign * (f.u[q] - f.u[p]), sign * (f.v[q] - f.v[p]),
                 with_its_points ? 0.0 : std::numeric_limits<double>::min()};
  }
  // No point lies on a border between cells.
  t.low_u = border(a.i, cols.from), t.end_u = border(a.i, cols.to + 1);
  t.low_v = border(a.j, rows.from), t.end_v = border(a.j, rows.to + 1);
  t.low_w = a.k * edge, t.end_w = (a.k + 1.0) * edge;
  t.u0 = f.u[0], t.v0 = f.v[0], t.w0 = f.w[0];
  t.nu = f.nu, t.nv = f.nv, t.nw = f.nw;
  return t;
}

void own(const lattice::Facet& f, const TileAddress& a, Ownership& all) {
  const double s = lattice::cell_size_m(a.level);
  const auto [u_lo, u_hi] = std::minmax({f.u[0], f.u[1], f.u[2]});
  const auto [v_lo, v_hi] = std::minmax({f.v[0], f.v[1], f.v[2]});
  const CellRange cols = cells_between(u_lo, u_hi, s, a.i), rows = cells_between(v_lo, v_hi, s, a.j);
  if (cols.from > cols.to || rows.from > rows.to) return;
  const cell_lanes::FacetTest test = test_of(f, a, cols, rows);
  const auto facet = static_cast<std::int32_t>(all.facets.size());
  const Vec3d normal = lattice::from_permuted(f.nu, f.nv, f.nw, a.axis);
  all.facets.push_back(
      {{normal_counts(normal.x), normal_counts(normal.y), normal_counts(normal.z)}, s / std::sqrt(std::abs(f.nw))});
  cell_lanes::BlockHeights found;
  for (int row = rows.from / 4; row <= rows.to / 4; ++row)
    for (int col = cols.from / 4; col <= cols.to / 4; ++col) {
      const int which = row * (side / 4) + col;
      if (cell_lanes::own_block(test, all.points, which, facet, all.first, found)) continue;
      for (int l = 0; l < cell_lanes::block; ++l) {
        if (!found.owned[l]) continue;
        const int p = which * cell_lanes::block + l;
        if (all.first.facet[p] < 0) {
          all.first.facet[p] = facet;
          all.first.w[p] = found.w[l];
        } else {
          all.again.push_back({p, facet, found.w[l]});
        }
      }
    }
}

/// The cells of a tile in their order. Copies of the last cell, but with root 0, fill the last block.
struct CellList {
  explicit CellList(std::size_t most)
      : doubles(std::make_unique_for_overwrite<double[]>(4 * most)),
        words(std::make_unique_for_overwrite<std::uint32_t[]>(3 * most)),
        floats(std::make_unique_for_overwrite<float[]>(2 * most)) {
    std::size_t n = 0;
    for (double** d : {&u, &v, &w, &root}) *d = doubles.get() + most * n++;
    n = 0;
    for (std::uint32_t** d : {&speckle_a, &speckle_b, &facet}) *d = words.get() + most * n++;
    re = floats.get(), im = re + most;
  }
  std::unique_ptr<double[]> doubles;
  std::unique_ptr<std::uint32_t[]> words;
  std::unique_ptr<float[]> floats;
  double *u, *v, *w, *root;
  std::uint32_t *speckle_a, *speckle_b, *facet;
  float *re, *im;
  int size = 0, padded = 0;

  void put(int n, const cell_lanes::Points& from, int p, std::int64_t of_facet, double height) const {
    u[n] = from.u[p];
    v[n] = from.v[p];
    w[n] = height;
    speckle_a[n] = from.speckle_a[p];
    speckle_b[n] = from.speckle_b[p];
    facet[n] = static_cast<std::uint32_t>(of_facet);
  }
};

CellList list_cells(Ownership& all) {
  CellList cells(cell_lanes::points + all.again.size() + CellTile::block);
  std::stable_sort(all.again.begin(), all.again.end(), [](const auto& a, const auto& b) { return a.point < b.point; });
  auto again = all.again.cbegin();
  int n = 0;
  for (int p = 0; p < cell_lanes::points; ++p) {
    cells.put(n, all.points, p, all.first.facet[p],
              all.first.w[p]);  // if the point has no owner, the next point overwrites this cell
    n += all.first.facet[p] >= 0;
    for (; again != all.again.cend() && again->point == p; ++again) cells.put(n++, all.points, p, again->facet, again->w);
  }
  cells.size = n;
  cells.padded = (n + CellTile::block - 1) / CellTile::block * CellTile::block;
  for (; n < cells.padded; ++n) {
    const int last = cells.size - 1;
    cells.u[n] = cells.u[last];
    cells.v[n] = cells.v[last];
    cells.w[n] = cells.w[last];
    cells.facet[n] = cells.facet[last];
    cells.speckle_a[n] = cells.speckle_b[n] = 0;
    cells.root[n] = 0;
  }
  return cells;
}

void find_roots(const Ownership& all, const TileAddress& a, const TextureField* texture, const TextureField* grain,
                const CellList& cells) {
  for (int n = 0; n < cells.size; ++n) cells.root[n] = all.facets[cells.facet[n]].root_area;
  for (const TextureField* field : {texture, grain}) {
    if (!field) continue;
    std::array<const double*, 3> places{};
    places[static_cast<std::size_t>(lattice::u_axis(a.axis))] = cells.u;
    places[static_cast<std::size_t>(lattice::v_axis(a.axis))] = cells.v;
    places[static_cast<std::size_t>(a.axis)] = cells.w;
    TexturePatch(*field, a.object).multiply(places, cells.padded, cells.root);
  }
}

/// Scales each weight to the magnitude of its cell's root. Returns the largest weight.
float scale_to_one_magnitude(const CellList& cells) {
  double most = 0;
  for (int n = 0; n < cells.size; ++n) {
    const auto re = static_cast<double>(cells.re[n]), im = static_cast<double>(cells.im[n]), size = std::sqrt(re * re + im * im);
    const double scale = size > 0 ? cells.root[n] / size : 0;
    cells.re[n] = static_cast<float>(re * scale), cells.im[n] = static_cast<float>(im * scale);
    most = std::max(most, cells.root[n]);
  }
  return static_cast<float>(most);
}

/// Computes the FNV-1a hash of the words of the first block of weights.
std::uint64_t hash_of_weights(const CellTile& tile) {
  std::uint64_t hash = 0xCBF29CE484222325u;
  for (const CellTile::Column c : {CellTile::weight_re, CellTile::weight_im}) {
    std::array<std::uint64_t, CellTile::block * sizeof(std::int16_t) / sizeof(std::uint64_t)> words;
    std::memcpy(words.data(), tile.column(c), sizeof words);
    for (const std::uint64_t word : words) hash = (hash ^ word) * 0x100000001B3u;
  }
  return hash;
}

void pack(const Ownership& all, const TileAddress& a, const CellList& cells, CellWeights weights, CellTile& tile) {
  const int n = cells.padded;
  tile.count = tile.stride = n;
  tile.data = std::make_unique_for_overwrite<std::int16_t[]>(static_cast<std::size_t>(n) * CellTile::columns);
  const auto column = [&](int c) { return tile.data.get() + static_cast<std::ptrdiff_t>(c) * n; };

  const double edge = lattice::tile_edge_m(a.level), unit = static_cast<double>(tile.position_unit_m);
  const auto along = [&](const double* places, std::int32_t index, int axis) {
    return cell_lanes::pack_places(places, n, (index + 0.5) * edge, unit, column(CellTile::x + axis));
  };
  const cell_lanes::Extent u = along(cells.u, a.i, lattice::u_axis(a.axis)), v = along(cells.v, a.j, lattice::v_axis(a.axis)),
                           w = along(cells.w, a.k, a.axis);
  const Vec3d low = lattice::from_permuted(u.low, v.low, w.low, a.axis),
              high = lattice::from_permuted(u.high, v.high, w.high, a.axis);
  tile.box_middle_m = to_float(0.5 * (low + high));
  tile.box_half_m = to_float(0.5 * (high - low) + Vec3d{unit, unit, unit});

  std::int16_t *normal_x = column(CellTile::normal_x), *normal_y = column(CellTile::normal_y),
               *normal_z = column(CellTile::normal_z);
  const FacetOfCells* facets = all.facets.data();
  for (int i = 0; i < n; ++i) {
    const std::int16_t* normal = facets[cells.facet[i]].normal;
    normal_x[i] = normal[0], normal_y[i] = normal[1], normal_z[i] = normal[2];
  }

  float peak = cell_lanes::speckle(cells.speckle_a, cells.speckle_b, cells.root, n, cells.re, cells.im);
  if (weights == CellWeights::of_one_magnitude) peak = scale_to_one_magnitude(cells);
  tile.weight_unit = peak > 0 ? peak / 32767.0f : 1.0f;
  cell_lanes::pack_weights(cells.re, n, tile.weight_unit, column(CellTile::weight_re));
  cell_lanes::pack_weights(cells.im, n, tile.weight_unit, column(CellTile::weight_im));
  tile.weights_hash = hash_of_weights(tile);
}

cell_lanes::DrawKey draw_key(const TileAddress& a, std::uint32_t texture_seed, Seed seed) {
  const RandomKey key = key_of(seed, Domain::cells);
  const std::uint32_t patch = static_cast<std::uint32_t>(a.object) * 8u + static_cast<std::uint32_t>(a.axis) * 2u +
                              static_cast<std::uint32_t>(a.negative_side);
  return {patch, static_cast<std::uint32_t>(a.level), key.low, key.high ^ texture_seed};
}

}  // namespace

CellTile build_tile(const TileAddress& a, const Mesh& mesh, std::span<const std::uint32_t> triangles, std::uint32_t texture_seed,
                    Seed seed, const TextureField* texture, const TextureField* grain, CellWeights weights) {
  const double edge = lattice::tile_edge_m(a.level);
  CellTile tile;
  tile.object = a.object;
  tile.material = a.material;
  tile.axis = a.axis;
  tile.level = a.level;
  tile.centre_m = lattice::from_permuted((a.i + 0.5) * edge, (a.j + 0.5) * edge, (a.k + 0.5) * edge, a.axis);
  tile.half_edge_m = static_cast<float>(edge / 2);
  tile.position_unit_m = static_cast<float>(edge / 2 / 32700.0);

  Ownership all;
  all.facets.reserve(triangles.size());
  cell_lanes::draw_points(draw_key(a, texture_seed, seed), a.i * side, a.j * side, lattice::cell_size_m(a.level), all.points);
  std::fill(std::begin(all.first.facet), std::end(all.first.facet), -1);
  for (const std::uint32_t t : triangles) own(lattice::facet_of(mesh, t, a.axis), a, all);
  const CellList cells = list_cells(all);
  if (cells.size == 0) return tile;
  find_roots(all, a, texture, grain, cells);
  pack(all, a, cells, weights, tile);
  return tile;
}

}  // namespace sonar
