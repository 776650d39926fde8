#include "core/scene/files/clean_mesh.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/scene/vertex_table.hpp"

namespace sonar {
namespace {

// A triangle has an area if its height divided by its longest side exceeds rounding errors.
bool has_area(Vec3 a, Vec3 b, Vec3 c) {
  const Vec3d ab = to_double(b) - to_double(a), ac = to_double(c) - to_double(a), bc = ac - ab;
  const double longest = std::max({dot(ab, ab), dot(ac, ac), dot(bc, bc)});
  return length(cross(ab, ac)) > 1e-6 * longest && longest > 1e-12;
}

bool is_within(Vec3d p, Vec3d low, Vec3d high) {  // false if a coordinate is not a number
  return p.x >= low.x && p.y >= low.y && p.z >= low.z && p.x <= high.x && p.y <= high.y && p.z <= high.z;
}

}  // namespace

Result<CentredMesh> clean_triangles(const TriangleSource& source, std::size_t most) {
  const auto bad = [](std::string what) { return failure(ErrorKind::bad_data, std::move(what)); };
  constexpr double huge = std::numeric_limits<double>::infinity();
  std::size_t count = 0;
  bool finite = true;
  Vec3d low{huge, huge, huge}, high{-huge, -huge, -huge};
  source([&](std::span<const Vec3d, 3> corners, std::uint16_t) {
    ++count;
    for (const Vec3d& p : corners) {
      finite = finite && is_finite(p);
      low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
      high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
    }
  });
  if (count == 0) return bad("has no triangles; export faces, not only points or lines");
  if (count > most) return bad("has more than " + std::to_string(most) + " triangles; simplify it");
  if (!finite) return bad("has vertices that are not finite numbers; export it again");
  const double far = std::max({std::abs(low.x), std::abs(low.y), std::abs(low.z), high.x, high.y, high.z});
  if (far > 1e7) return bad("reaches beyond 1e7 m; set \"scale\" (0.001 for millimetres) or move it to the origin");

  CentredMesh out;
  out.centre_m = 0.5 * (low + high);
  VertexTable vertices(out.mesh.vertices, count / 2);  // number of vertices of a closed surface
  out.mesh.triangles.reserve(count);
  out.mesh.material.reserve(count);
  // The file may have changed between the passes.
  std::size_t again = 0;
  bool same = true;
  source([&](std::span<const Vec3d, 3> corners, std::uint16_t material) {
    Vec3 p[3];
    for (std::size_t k = 0; k < 3; ++k) {
      same = same && is_within(corners[k], low, high);
      p[k] = to_float(corners[k] - out.centre_m);
    }
    same = same && ++again <= count;
    if (!same) return;
    if (!has_area(p[0], p[1], p[2])) {
      ++out.left_out;
      return;
    }
    out.mesh.triangles.push_back({vertices.index_of(p[0]), vertices.index_of(p[1]), vertices.index_of(p[2])});
    out.mesh.material.push_back(material);
  });
  if (!same || again != count) return bad("changed while it was read; load it again");
  if (out.mesh.triangles.empty()) return bad("has only triangles without area; check its units and \"scale\"");
  return out;
}

Result<CentredMesh> clean_mesh(const std::vector<Vec3d>& corners, const std::vector<std::uint16_t>& material, std::size_t most) {
  return clean_triangles(
      [&](const TriangleSink& take) {
        for (std::size_t t = 0; t < corners.size() / 3; ++t)
          take(std::span<const Vec3d, 3>(&corners[3 * t], 3), t < material.size() ? material[t] : std::uint16_t{0});
      },
      most);
}

}  // namespace sonar
