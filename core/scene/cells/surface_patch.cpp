#include "core/scene/cells/surface_patch.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>
#include <utility>

namespace sonar {
namespace {

constexpr int most_roots_along_an_axis = 16;
constexpr double most_steep = 4;      // largest ratio of cell areas at steep and at grazing incidence
constexpr int few_in_side_lobes = 2;  // in levels; an object has at least a sixteenth of fewest_cells in side lobes

/// The finest level (at most `finest`) at which a row of 16 cubes is at least as long as the extent of the triangles.
int root_level(const Mesh& mesh, const std::vector<std::uint32_t>& triangles, int finest) {
  Vec3 lo = mesh.vertices[mesh.triangles[triangles.front()][0]], hi = lo;
  for (const std::uint32_t t : triangles)
    for (const std::uint32_t index : mesh.triangles[t]) {
      const Vec3 p = mesh.vertices[index];
      lo = {std::min(lo.x, p.x), std::min(lo.y, p.y), std::min(lo.z, p.z)};
      hi = {std::max(hi.x, p.x), std::max(hi.y, p.y), std::max(hi.z, p.z)};
    }
  const double extent = std::max({hi.x - lo.x, hi.y - lo.y, hi.z - lo.z});
  int level = finest;
  while (lattice::tile_edge_m(level) * most_roots_along_an_axis < extent) --level;
  return level;
}

}  // namespace

void SurfacePatch::plant(const std::vector<std::uint32_t>& triangles) {
  const int level = root_level(*mesh, triangles, finest_root);
  const double e = lattice::tile_edge_m(level);
  std::map<std::tuple<std::int32_t, std::int32_t, std::int32_t>, std::unique_ptr<CellNode>> planted;
  const auto index = [&](double x) { return static_cast<std::int32_t>(std::floor(x / e)); };
  for (const std::uint32_t t : triangles) {
    const lattice::Facet f = lattice::facet_of(*mesh, t, axis);
    const auto [u_lo, u_hi] = std::minmax({f.u[0], f.u[1], f.u[2]});
    const auto [v_lo, v_hi] = std::minmax({f.v[0], f.v[1], f.v[2]});
    const auto [w_lo, w_hi] = std::minmax({f.w[0], f.w[1], f.w[2]});
    const double slack = e * 1e-6;
    const lattice::FacetBounds bounds = lattice::bounds_of(f);
    for (std::int32_t i = index(u_lo - slack); i <= index(u_hi + slack); ++i)
      for (std::int32_t j = index(v_lo - slack); j <= index(v_hi + slack); ++j)
        for (std::int32_t k = index(w_lo - slack); k <= index(w_hi + slack); ++k) {
          const TileAddress a{object, material, axis, negative_side, level, i, j, k};
          if (!may_touch(bounds, cube_of(a))) continue;
          auto& node = planted[{i, j, k}];
          if (!node) {
            node = std::make_unique<CellNode>();
            node->address = a;
          }
          node->triangles.push_back(t);
        }
  }
  for (auto& [where, node] : planted) roots.push_back(std::move(node));
}

void SurfacePatch::raise(int level) {
  if (roots.empty() || roots.back()->address.level <= level) return;
  std::map<std::tuple<std::int32_t, std::int32_t, std::int32_t>, std::unique_ptr<CellNode>> raised;
  for (std::size_t r = first_coarsest; r < roots.size(); ++r) {
    TileAddress a = roots[r]->address;
    --a.level;
    a.i >>= 1, a.j >>= 1, a.k >>= 1;  // rounds down, also below 0
    auto& node = raised[{a.i, a.j, a.k}];
    if (!node) {
      node = std::make_unique<CellNode>();
      node->address = a;
      node->alone = true;
    }
    node->triangles.insert(node->triangles.end(), roots[r]->triangles.begin(), roots[r]->triangles.end());
  }
  first_coarsest = roots.size();
  for (auto& [where, node] : raised) {
    std::sort(node->triangles.begin(), node->triangles.end());
    node->triangles.erase(std::unique(node->triangles.begin(), node->triangles.end()), node->triangles.end());
    roots.push_back(std::move(node));
  }
}

std::size_t SurfacePatch::divide(CellNode& node) const {
  std::array<TileAddress, 8> inside;
  std::array<Cube, 8> cubes;
  for (int c = 0; c < 8; ++c) {
    TileAddress& a = inside[static_cast<std::size_t>(c)] = node.address;
    ++a.level;
    a.i = a.i * 2 + (c & 1);
    a.j = a.j * 2 + (c >> 1 & 1);
    a.k = a.k * 2 + (c >> 2 & 1);
    cubes[static_cast<std::size_t>(c)] = cube_of(a);
  }
  std::vector<std::uint8_t> touched(node.triangles.size());  // bit set of the cubes that each triangle touches
  std::array<std::size_t, 8> how_many{};
  for (std::size_t n = 0; n < touched.size(); ++n) {
    const lattice::FacetBounds f = lattice::bounds_of(lattice::facet_of(*mesh, node.triangles[n], axis));
    unsigned bits = 0;
    for (std::size_t c = 0; c < 8; ++c) {
      const bool touches = may_touch(f, cubes[c]);
      bits |= static_cast<unsigned>(touches) << c;
      how_many[c] += touches;
    }
    touched[n] = static_cast<std::uint8_t>(bits);
  }
  std::size_t bytes = 0;
  for (std::size_t c = 0; c < 8; ++c) {
    if (how_many[c] == 0) continue;
    node.children[c] = std::make_unique<CellNode>();
    node.children[c]->address = inside[c];
    node.children[c]->triangles.reserve(how_many[c]);
    for (std::size_t n = 0; n < touched.size(); ++n)
      if (touched[n] >> c & 1) node.children[c]->triangles.push_back(node.triangles[n]);
  }
  for (const auto& child : node.children)
    if (child) bytes += child->own_bytes();
  node.divided.store(true, std::memory_order_release);
  return bytes;
}

int SurfacePatch::side_level(const TileAddress& address, Vec3d sonar_m, const CellView& view) const {
  const Cube cube = cube_of(address);
  const Vec3d q = lattice::from_permuted(cube.u, cube.v, cube.w, axis) - sonar_m;
  const double along = axis == 0 ? q.x : axis == 1 ? q.y : q.z, range = length(q);
  // The cosine of the grazing angle on a surface at right angles to the patch's axis is the distance from the axis divided by
  // the range.
  const double aside = std::sqrt(std::max(range * range - along * along, 0.0));
  const double steep = range < most_steep * aside ? range / aside : most_steep;
  const double area = static_cast<double>(view.side_area_per_range_m) * steep * std::max(range - cube.radius() / 2, 0.0);
  const int finest = view.levels.back().level, coarsest_seen = view.levels.front().level - view.side_coarser;
  // Cells of this level have at most that area: 2^(-2 level) <= area. The exponent of the area is exact.
  int exponent = 0;
  std::frexp(area, &exponent);
  const int by_area = area > 0 ? std::clamp((2 - exponent) >> 1, coarsest_seen, finest) : finest;
  return std::max(by_area, view.exact_small ? coarsest : std::min(coarsest - few_in_side_lobes, finest));
}

bool SurfacePatch::has_side_cells(const TileAddress& address, Vec3d sonar_m, const CellView& view) const {
  if (side_level(address, sonar_m, view) > address.level) return false;
  TileAddress around = address;
  while (--around.level >= view.levels.front().level - view.side_coarser) {
    around.i >>= 1, around.j >>= 1, around.k >>= 1;
    if (side_level(around, sonar_m, view) <= around.level) return false;
  }
  return true;
}

namespace {

/// Adds the results of `of` for a cube and for all cubes inside it.
template <class CellNode, class Of>
std::size_t sum_over(CellNode& node, const Of& of) {
  std::size_t sum = of(node);
  for (auto& child : node.children)
    if (child) sum += sum_over(*child, of);
  return sum;
}

}  // namespace

std::size_t SurfacePatch::fixed_bytes() const {
  std::size_t bytes = mesh->vertices.size() * sizeof(Vec3) + mesh->triangles.size() * sizeof(mesh->triangles[0]);
  for (const auto& root : roots) bytes += root->own_bytes() - root->tile_bytes();
  return bytes;
}

std::size_t SurfacePatch::forget_tiles() {
  std::size_t freed = 0;
  for (auto& root : roots) freed += sum_over(*root, [](CellNode& node) { return node.forget_tiles(); });
  return freed;
}

std::size_t SurfacePatch::forget_below(CellNode& node, std::uint64_t then) {
  std::size_t freed = 0;
  bool stale = node.divided;
  for (const auto& child : node.children) {
    if (!child) continue;
    freed += forget_below(*child, then);
    stale = stale && child->last_visited < then;
  }
  if (!stale) return freed;  // eight cubes are always added or removed together, so that `divided` is correct
  for (auto& child : node.children) {
    if (!child) continue;
    freed += child->own_bytes();
    child.reset();
  }
  node.divided = false;
  return freed;
}

}  // namespace sonar
