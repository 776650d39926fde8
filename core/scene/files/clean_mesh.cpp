#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <unordered_map>

#include "core/scene/files/load_mesh.hpp"

namespace sonar {
namespace {

struct VertexKey {
  std::array<std::uint32_t, 3> bits;
  bool operator==(const VertexKey&) const = default;
};
struct VertexHash {
  std::size_t operator()(const VertexKey& k) const {
    std::uint64_t h = 0x9E3779B97F4A7C15u;
    for (const std::uint32_t b : k.bits) h = (h ^ b) * 0xBF58476D1CE4E5B9u, h ^= h >> 29;
    return static_cast<std::size_t>(h);
  }
};

VertexKey key_of(Vec3 v) {
  const auto bits = [](float f) { return std::bit_cast<std::uint32_t>(f == 0 ? 0.0f : f); };  // -0 and 0 are one place
  return {{bits(v.x), bits(v.y), bits(v.z)}};
}

// A triangle counts when its height over its longest side is more than rounding.
bool has_area(Vec3 a, Vec3 b, Vec3 c) {
  const Vec3d ab = to_double(b) - to_double(a), ac = to_double(c) - to_double(a), bc = ac - ab;
  const double longest = std::max({dot(ab, ab), dot(ac, ac), dot(bc, bc)});
  return length(cross(ab, ac)) > 1e-6 * longest && longest > 1e-12;
}

}  // namespace

Result<CentredMesh> clean_mesh(const std::vector<Vec3d>& corners, const std::vector<std::uint16_t>& material, std::size_t most) {
  const auto bad = [](std::string what) { return failure(ErrorKind::bad_data, std::move(what)); };
  const std::size_t count = corners.size() / 3;
  if (count == 0) return bad("has no triangles; export faces, not only points or lines");
  if (count > most) return bad("has more than " + std::to_string(most) + " triangles; simplify it");
  constexpr double huge = std::numeric_limits<double>::infinity();
  Vec3d low{huge, huge, huge}, high{-huge, -huge, -huge};
  for (const Vec3d& p : corners) {
    if (!is_finite(p)) return bad("has vertices that are not finite numbers; export it again");
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }
  const double far = std::max({std::abs(low.x), std::abs(low.y), std::abs(low.z), high.x, high.y, high.z});
  if (far > 1e7) return bad("reaches beyond 1e7 m; set \"scale\" (0.001 for millimetres) or move it to the origin");

  CentredMesh out;
  out.centre_m = 0.5 * (low + high);
  std::unordered_map<VertexKey, std::uint32_t, VertexHash> known;
  known.reserve(count);
  const auto vertex = [&](Vec3 v) {
    const auto [place, is_new] = known.try_emplace(key_of(v), static_cast<std::uint32_t>(out.mesh.vertices.size()));
    if (is_new) out.mesh.vertices.push_back(v);
    return place->second;
  };
  out.mesh.triangles.reserve(count);
  out.mesh.material.reserve(count);
  for (std::size_t t = 0; t < count; ++t) {
    Vec3 p[3];
    for (std::size_t k = 0; k < 3; ++k) p[k] = to_float(corners[3 * t + k] - out.centre_m);
    if (!has_area(p[0], p[1], p[2])) {
      ++out.left_out;
      continue;
    }
    out.mesh.triangles.push_back({vertex(p[0]), vertex(p[1]), vertex(p[2])});
    out.mesh.material.push_back(t < material.size() ? material[t] : std::uint16_t{0});
  }
  if (out.mesh.triangles.empty()) return bad("has only triangles without area; check its units and \"scale\"");
  return out;
}

}  // namespace sonar
