// Conditions of every mesh: indices in range, triangles with area, and, for solids, closed with normals outwards.
#pragma once

#include <gtest/gtest.h>

#include <map>

#include "core/scene/scene.hpp"

namespace sonar::tests {

inline void expect_sound(const Mesh& mesh) {
  ASSERT_FALSE(mesh.triangles.empty());
  ASSERT_EQ(mesh.material.size(), mesh.triangles.size());
  for (const Vec3& v : mesh.vertices) ASSERT_TRUE(is_finite(to_double(v)));
  for (const auto& t : mesh.triangles) {
    for (const std::uint32_t i : t) ASSERT_LT(i, mesh.vertices.size());
    const Vec3d a = to_double(mesh.vertices[t[0]]), b = to_double(mesh.vertices[t[1]]), c = to_double(mesh.vertices[t[2]]);
    ASSERT_GT(length(cross(b - a, c - a)), 0);
  }
}

// Signed volume (divergence theorem); positive when normals point outwards.
inline double volume(const Mesh& mesh) {
  double v = 0;
  for (const auto& t : mesh.triangles) {
    const Vec3d a = to_double(mesh.vertices[t[0]]), b = to_double(mesh.vertices[t[1]]), c = to_double(mesh.vertices[t[2]]);
    v += dot(a, cross(b, c)) / 6;
  }
  return v;
}

inline double area(const Mesh& mesh) {
  double s = 0;
  for (const auto& t : mesh.triangles) {
    const Vec3d a = to_double(mesh.vertices[t[0]]), b = to_double(mesh.vertices[t[1]]), c = to_double(mesh.vertices[t[2]]);
    s += length(cross(b - a, c - a)) / 2;
  }
  return s;
}

// Expects every edge once in each direction.
inline void expect_closed(const Mesh& mesh) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  for (const auto& t : mesh.triangles) {
    for (std::size_t k = 0; k < 3; ++k) ++edges[{t[k], t[(k + 1) % 3]}];
  }
  for (const auto& [edge, count] : edges) {
    ASSERT_EQ(count, 1);
    ASSERT_EQ(edges.count({edge.second, edge.first}), 1u);
  }
}

}  // namespace sonar::tests
