// Fuzzes the validation of imported meshes. A script of bytes makes corners; some are not numbers, are far away, are equal or are
// in a line. If the first byte is odd, they are corners of polygons of any size, which are first cut into triangles. The result
// is a valid mesh, or a sentence.
#include <vector>

#include "core/scene/files/mesh_steps.hpp"
#include "core/scene/shapes/polygon.hpp"
#include "tests/fuzz/mesh_script.hpp"

namespace {

using namespace sonar;
using fuzz::coordinate;
using fuzz::require;
using fuzz::Script;

constexpr std::size_t most_corners = 600;

Vec3d place(Script& script, const std::vector<Vec3d>& others) {
  if (script.byte() % 8 == 0 && !others.empty()) return others[script.byte() % others.size()];
  const double x = coordinate(script), y = coordinate(script);
  return {x, y, coordinate(script)};
}

std::vector<Vec3d> corners_of_triangles(Script& script) {
  std::vector<Vec3d> corners;
  while (!script.ended() && corners.size() < most_corners) corners.push_back(place(script, corners));
  return corners;
}

std::vector<Vec3d> corners_of_polygons(Script& script) {
  std::vector<Vec3d> corners;
  while (!script.ended() && corners.size() < most_corners) {
    std::vector<Vec3d> polygon;
    for (int left = script.byte() % 24; left > 0; --left) polygon.push_back(place(script, polygon));
    const auto triangles = triangulate(polygon);
    require(triangles.size() + 2 <= polygon.size() || triangles.empty());
    for (const auto& triangle : triangles)
      for (const std::uint32_t k : triangle) {
        require(k < polygon.size());
        corners.push_back(polygon[k]);
      }
  }
  return corners;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  Script script(data + 1, size - 1);
  const std::vector<Vec3d> corners = data[0] % 2 == 1 ? corners_of_polygons(script) : corners_of_triangles(script);
  const std::vector<std::uint16_t> material(corners.size() / 4, 3);  // fewer than there are triangles
  const auto made = clean_mesh(corners, material, most_corners / 4);
  if (!made) {
    require(!made.error().text.empty());
    return 0;
  }
  for (std::size_t i = 0; i < corners.size() / 3 * 3; ++i) {
    const Vec3d p = corners[i];
    require(is_finite(p) && std::abs(p.x) <= 1e7 && std::abs(p.y) <= 1e7 && std::abs(p.z) <= 1e7);
  }
  fuzz::check(*made, corners.size() / 3);
  return 0;
}
