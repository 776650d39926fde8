#include "core/scene/shapes/terrain.hpp"

#include <cmath>
#include <limits>

namespace sonar {

Result<CentredMesh> mesh_from_grid(const HeightGrid& grid) {
  const std::size_t columns = grid.x_m.size(), rows = grid.y_m.size();
  if (columns < 2 || rows < 2) return failure(ErrorKind::bad_data, "a height grid needs at least 2 x 2 heights");
  if (2 * (columns - 1) * (rows - 1) > max_mesh_triangles) {
    return failure(ErrorKind::bad_data, "the grid of " + std::to_string(columns) + " x " + std::to_string(rows) +
                                            " heights makes more than 20 million triangles; use a coarser one");
  }
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const float z : grid.z_m) {
    if (std::isnan(z)) continue;
    low = std::min(low, static_cast<double>(z));
    high = std::max(high, static_cast<double>(z));
  }
  if (low > high) return failure(ErrorKind::bad_data, "no cell of the grid has a height");
  CentredMesh out;
  out.centre_m = {0.5 * (grid.x_m.front() + grid.x_m.back()), 0.5 * (grid.y_m.front() + grid.y_m.back()), 0.5 * (low + high)};
  constexpr std::uint32_t none = 0xFFFFFFFFu;
  std::vector<std::uint32_t> index(grid.z_m.size(), none);
  out.mesh.vertices.reserve(grid.z_m.size());
  for (std::size_t j = 0, k = 0; j < rows; ++j) {
    for (std::size_t i = 0; i < columns; ++i, ++k) {
      if (std::isnan(grid.z_m[k])) continue;
      index[k] = static_cast<std::uint32_t>(out.mesh.vertices.size());
      const Vec3d p{grid.x_m[i], grid.y_m[j], static_cast<double>(grid.z_m[k])};
      out.mesh.vertices.push_back(to_float(p - out.centre_m));
    }
  }
  out.mesh.triangles.reserve(2 * (columns - 1) * (rows - 1));
  for (std::size_t j = 0; j + 1 < rows; ++j) {
    for (std::size_t i = 0; i + 1 < columns; ++i) {
      const std::size_t k = j * columns + i;
      const std::uint32_t a = index[k], b = index[k + 1], c = index[k + 1 + columns], d = index[k + columns];
      if (a == none || b == none || c == none || d == none) continue;
      if ((i + j) % 2 == 0) {  // diagonals alternate, so that slopes have no preferred side
        out.mesh.triangles.push_back({a, b, c});
        out.mesh.triangles.push_back({a, c, d});
      } else {
        out.mesh.triangles.push_back({a, b, d});
        out.mesh.triangles.push_back({b, c, d});
      }
    }
  }
  if (out.mesh.triangles.empty()) return failure(ErrorKind::bad_data, "no four neighbouring cells of the grid have heights");
  out.mesh.material.assign(out.mesh.triangles.size(), 0);
  return out;
}

}  // namespace sonar
