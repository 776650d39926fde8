// Checks conditions of every grid of heights from any format, and that its mesh is valid.
#pragma once

#include <cmath>

#include "core/scene/shapes/terrain.hpp"
#include "tests/fuzz/byte_script.hpp"
#include "tests/fuzz/memory_file.hpp"

namespace sonar::fuzz {

inline void check(const Mesh& mesh) {
  require(!mesh.triangles.empty() && mesh.material.size() == mesh.triangles.size());
  for (const Vec3& v : mesh.vertices) require(is_finite(to_double(v)));
  for (const auto& t : mesh.triangles) {
    for (const std::uint32_t i : t) require(i < mesh.vertices.size());
    const Vec3d a = to_double(mesh.vertices[t[0]]), b = to_double(mesh.vertices[t[1]]), c = to_double(mesh.vertices[t[2]]);
    require(length(cross(b - a, c - a)) > 0);
  }
}

/// Checks a grid. Grids of up to a few thousand heights are also converted to meshes.
inline void check(const HeightGrid& grid) {
  require(grid.x.size() >= 2 && grid.y.size() >= 2 && grid.z_m.size() == grid.x.size() * grid.y.size());
  require(2 * grid.z_m.size() <= max_mesh_triangles);
  for (const auto* axis : {&grid.x, &grid.y})
    for (std::size_t i = 0; i < axis->size(); ++i) require(std::isfinite((*axis)[i]) && (i == 0 || (*axis)[i] > (*axis)[i - 1]));
  if (grid.z_m.size() > 4096) return;
  for (const float z : grid.z_m) require(std::isnan(z) || std::abs(z) <= 1e7f);
  const auto made = mesh_from_grid(grid);
  if (!made) return require(!made.error().text.empty());
  require(is_finite(made->centre_m));
  check(made->mesh);
}

/// Checks that a reader of files returns a valid grid or a sentence that begins with the name of the file, for any bytes.
template <class Read>
void check_grid_reader(const std::uint8_t* data, std::size_t size, Read&& read) {
  static const MemoryFile file;
  file.fill({data, size});
  const Result<HeightGrid> grid = read(file.path());
  if (grid) {
    check(*grid);
  } else {
    require(grid.error().text.starts_with(file.path().string() + ": "));
  }
}

}  // namespace sonar::fuzz
