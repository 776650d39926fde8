#include "core/scene/closed_mesh.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <tuple>
#include <utility>
#include <vector>

namespace sonar {
namespace {

using Index = std::uint32_t;

/// Finds, for each vertex, the first vertex at the same position. Files repeat vertices if normals or colours differ.
std::vector<Index> joined_vertices(const Mesh& mesh) {
  std::vector<Index> order(mesh.vertices.size());
  std::iota(order.begin(), order.end(), 0u);
  const auto place = [&](Index i) {
    const Vec3& v = mesh.vertices[i];
    return std::tuple(v.x, v.y, v.z);
  };
  std::sort(order.begin(), order.end(), [&](Index a, Index b) { return std::pair(place(a), a) < std::pair(place(b), b); });
  std::vector<Index> first(order.size());
  for (std::size_t n = 0; n < order.size(); ++n)
    first[order[n]] = n > 0 && place(order[n]) == place(order[n - 1]) ? first[order[n - 1]] : order[n];
  return first;
}

/// Returns true if every edge is used twice, once in each direction.
bool edges_match(const Mesh& mesh, const std::vector<Index>& joined) {
  std::vector<std::uint64_t> edges;  // lower vertex, higher vertex, direction
  edges.reserve(3 * mesh.triangles.size());
  for (const auto& t : mesh.triangles)
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint64_t a = joined[t[i]], b = joined[t[(i + 1) % 3]];
      if (a == b) return false;
      edges.push_back(std::min(a, b) << 33 | std::max(a, b) << 1 | (a < b ? 0u : 1u));
    }
  if (edges.size() % 2 != 0) return false;
  std::sort(edges.begin(), edges.end());
  for (std::size_t i = 0; i < edges.size(); i += 2) {
    if (edges[i] + 1 != edges[i + 1] || (edges[i] & 1) != 0) return false;
    if (i > 0 && edges[i] >> 1 == edges[i - 1] >> 1) return false;
  }
  return true;
}

/// The sign of the volumes that the connected parts enclose; 0 if the signs differ.
int sign_of_volumes(const Mesh& mesh, std::vector<Index> root, Vec3d middle) {
  const auto find = [&](Index i) {
    while (root[i] != i) i = root[i] = root[root[i]];
    return i;
  };
  for (const auto& t : mesh.triangles) {
    const Index a = find(t[0]);
    root[find(t[1])] = a;
    root[find(t[2])] = a;
  }
  std::vector<double> volume(root.size());
  const auto corner = [&](Index i) { return to_double(mesh.vertices[i]) - middle; };
  for (const auto& t : mesh.triangles) volume[find(t[0])] += dot(corner(t[0]), cross(corner(t[1]), corner(t[2])));
  const bool some_positive = std::any_of(volume.begin(), volume.end(), [](double v) { return v > 0; });
  const bool some_negative = std::any_of(volume.begin(), volume.end(), [](double v) { return v < 0; });
  return static_cast<int>(some_positive) - static_cast<int>(some_negative);
}

}  // namespace

Skin skin_of(const Mesh& mesh) {
  Skin skin;
  if (mesh.triangles.empty()) return skin;
  skin.low = skin.high = to_double(mesh.vertices[mesh.triangles[0][0]]);
  // Twice the sum of the areas as vectors. It is 0 for a closed mesh. Thanks to this test the edges of terrain need not be
  // sorted.
  Vec3d twice_area;
  for (const auto& t : mesh.triangles) {
    const Vec3d a = to_double(mesh.vertices[t[0]]), b = to_double(mesh.vertices[t[1]]), c = to_double(mesh.vertices[t[2]]);
    const Vec3d twice = cross(b - a, c - a);
    twice_area = twice_area + twice;
    skin.area_m2 += 0.5 * length(twice);
    for (const Vec3d p : {a, b, c}) {
      skin.low = {std::min(skin.low.x, p.x), std::min(skin.low.y, p.y), std::min(skin.low.z, p.z)};
      skin.high = {std::max(skin.high.x, p.x), std::max(skin.high.y, p.y), std::max(skin.high.z, p.z)};
    }
  }
  if (length(twice_area) > 1e-5 * skin.area_m2) return skin;
  std::vector<Index> joined = joined_vertices(mesh);
  if (edges_match(mesh, joined)) skin.outward = sign_of_volumes(mesh, std::move(joined), 0.5 * (skin.low + skin.high));
  return skin;
}

bool encloses(const Mesh& mesh, Vec3d place) {
  double half_angle = 0;  // half of the solid angle (Van Oosterom and Strackee 1983)
  for (const auto& t : mesh.triangles) {
    const Vec3d a = to_double(mesh.vertices[t[0]]) - place, b = to_double(mesh.vertices[t[1]]) - place,
                c = to_double(mesh.vertices[t[2]]) - place;
    const double la = length(a), lb = length(b), lc = length(c);
    half_angle += std::atan2(dot(a, cross(b, c)), la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb);
  }
  return std::abs(half_angle) > pi;
}

}  // namespace sonar
