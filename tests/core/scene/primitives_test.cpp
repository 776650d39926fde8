#include "core/scene/shapes/primitives.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/core/scene/mesh_checks.hpp"

namespace sonar {
namespace {

using tests::area;
using tests::expect_closed;
using tests::expect_sound;
using tests::volume;

void expect_solid(const Mesh& mesh, double true_volume, double tolerance) {
  expect_sound(mesh);
  expect_closed(mesh);
  EXPECT_NEAR(volume(mesh) / true_volume, 1, tolerance);
  EXPECT_LT(volume(mesh), true_volume * (1 + 1e-6));  // chords lie inside convex bodies
}

TEST(Primitives, BoxIsExact) {
  const Mesh box = make_box({2.5, 0.3, 1.2}, 0.5);
  expect_sound(box);
  expect_closed(box);
  EXPECT_NEAR(volume(box), 0.9, 1e-6);
  EXPECT_NEAR(area(box), 2 * (2.5 * 0.3 + 2.5 * 1.2 + 0.3 * 1.2), 1e-5);
  EXPECT_EQ(make_box({1, 1, 1}, 5).triangles.size(), 12u);
}

TEST(Primitives, RoundSolidsAreClosedOutwardAndNearlyTheirVolume) {
  const double r = 0.5, h = 2;
  const int n = segments_for(r);
  expect_solid(make_sphere(r, n), 4 * pi / 3 * r * r * r, 0.01);
  expect_solid(make_cylinder(r, h, n), pi * r * r * h, 0.01);
  expect_solid(make_capsule(r, h, n), pi * r * r * h + 4 * pi / 3 * r * r * r, 0.01);
  expect_solid(make_cone(r, 0, h, n), pi * r * r * h / 3, 0.01);
  expect_solid(make_cone(r, 0.2, h, n), pi * h / 3 * (r * r + r * 0.2 + 0.04), 0.01);
  const Mesh torus = make_torus(r, 0.1, n);
  expect_sound(torus);
  expect_closed(torus);
  EXPECT_NEAR(volume(torus) / (2 * pi * pi * r * 0.01), 1, 0.03);
}

TEST(Primitives, ChordsStayWithinAMillimetre) {
  for (const double r : {0.02, 0.0508, 0.3, 2.0}) {
    const Mesh sphere = make_sphere(r, segments_for(r));
    double worst = 0;  // largest error at the middles of edges, where chords are deepest
    for (const auto& t : sphere.triangles) {
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec3d middle = 0.5 * (to_double(sphere.vertices[t[k]]) + to_double(sphere.vertices[t[(k + 1) % 3]]));
        worst = std::max(worst, r - length(middle));
      }
    }
    EXPECT_LT(worst, 0.0021) << r;  // two directions of curvature
    EXPECT_GT(worst, 0) << r;
  }
  EXPECT_EQ(segments_for(1e-5), 16);
  EXPECT_EQ(segments_for(1e5), 512);
}

TEST(Primitives, ShapesOfManySizesAreValid) {
  for (const double s : {1e-4, 1e-2, 1.0}) {
    for (const Mesh& m : {make_sphere(s, segments_for(s)), make_cylinder(s, 20 * s, segments_for(s)), make_box({s, s, 3 * s})}) {
      expect_sound(m);
      expect_closed(m);
    }
  }
}

TEST(Primitives, PlaneFacesUpInPatches) {
  const Mesh plane = make_plane(4, 2, 0.5);
  expect_sound(plane);
  EXPECT_EQ(plane.triangles.size(), 2u * 8 * 4);
  EXPECT_NEAR(area(plane), 8, 1e-5);
  for (const auto& t : plane.triangles) {
    const Vec3 a = plane.vertices[t[0]];
    EXPECT_GT(cross(plane.vertices[t[1]] - a, plane.vertices[t[2]] - a).z, 0);
  }
}

TEST(Primitives, OpenCylindersLackTheirLids) {
  const int n = 64;
  const double side = 2 * pi * 0.5 * 2, lid = pi * 0.25;
  EXPECT_NEAR(area(make_cylinder(0.5, 2, n, Caps::none)), side, 0.02);
  EXPECT_NEAR(area(make_cylinder(0.5, 2, n, Caps::bottom)), side + lid, 0.02);
  EXPECT_NEAR(area(make_cylinder(0.5, 2, n, Caps::both)), side + 2 * lid, 0.02);
  double top = -1;
  for (const Vec3& v : make_cylinder(0.5, 2, n, Caps::bottom).vertices) {
    if (std::hypot(v.x, v.y) < 0.1f) top = std::max(top, static_cast<double>(v.z));
  }
  EXPECT_EQ(top, -1);  // near the axis there is only the floor
}

TEST(Primitives, RocksDependOnTheirSeedAlone) {
  const Mesh a = make_rock({0.5, 0.4, 0.3}, 0.3, 7, 40), b = make_rock({0.5, 0.4, 0.3}, 0.3, 7, 40);
  const Mesh c = make_rock({0.5, 0.4, 0.3}, 0.3, 8, 40);
  expect_sound(a);
  expect_closed(a);
  EXPECT_GT(volume(a), 0.5 * 4 * pi / 3 * 0.06);
  bool same = true, differs = false;
  for (std::size_t i = 0; i < a.vertices.size(); ++i) {
    same &= a.vertices[i].x == b.vertices[i].x && a.vertices[i].z == b.vertices[i].z;
    differs |= a.vertices[i].x != c.vertices[i].x;
  }
  EXPECT_TRUE(same);
  EXPECT_TRUE(differs);
}

}  // namespace
}  // namespace sonar
