// Compares the mirror points of meshes with those of the surfaces that the meshes approximate.
#include "core/scene/specular/specular_mesh.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "core/scene/shapes/primitives.hpp"

namespace sonar {
namespace {

const std::vector<bool> all_materials{true};

std::vector<SpecularPoint> on_mesh(const Mesh& mesh, Vec3d sonar_m, double wavelength_m = 1e-3) {
  std::vector<SpecularPoint> points;
  SpecularMesh(mesh, all_materials).find({sonar_m, wavelength_m, 100}, points);
  std::sort(points.begin(), points.end(), [](const SpecularPoint& a, const SpecularPoint& b) { return a.range_m < b.range_m; });
  return points;
}
std::vector<SpecularPoint> on_primitive(const Primitive& primitive, Vec3d sonar_m) {
  std::vector<SpecularPoint> points;
  find_specular_points(primitive, {sonar_m, 1e-3, 100}, points);
  return points;
}

TEST(SpecularMesh, SphereHasANearAndAFarPoint) {
  const Mesh mesh = make_sphere(0.5, segments_for(0.5));
  std::mt19937 random(7);
  for (int i = 0; i < 50; ++i) {
    const auto uniform = [&] { return static_cast<double>(random()) / 4294967296.0 * 2 - 1; };
    Vec3d direction{uniform(), uniform(), uniform()};
    direction = (1 / length(direction)) * direction;
    const std::vector<SpecularPoint> points = on_mesh(mesh, 3.0 * direction);
    ASSERT_EQ(points.size(), 2u) << direction.x << " " << direction.y << " " << direction.z;
    EXPECT_NEAR(points[0].range_m, 2.5, 2e-4);
    EXPECT_NEAR(points[1].range_m, 3.5, 2e-4);  // the inside of the far half, hidden by the near half
    EXPECT_GT(dot(points[0].normal, direction), 0.9995);
    for (const double k : points[0].curvature) EXPECT_NEAR(k, 2, 0.25);
    for (const double k : points[1].curvature) EXPECT_NEAR(k, -2, 0.25);
  }
}

TEST(SpecularMesh, ACylinderHasNoEchoBeyondItsEnds) {
  const Mesh mesh = make_cylinder(0.3, 1.2, segments_for(0.3));
  for (const double angle : {0.0, 0.1, 1.234}) {
    for (const double z : {0.0, 0.25, -0.4}) {
      const std::vector<SpecularPoint> points = on_mesh(mesh, {2 * std::cos(angle), 2 * std::sin(angle), z}, 0.01);
      ASSERT_EQ(points.size(), 2u) << angle << " " << z;
      const SpecularPoint& p = points[0];
      EXPECT_NEAR(p.range_m, 1.7, 1e-3);
      const std::size_t up = std::abs(p.along[0].z) > 0.5 ? 0 : 1;
      EXPECT_NEAR(p.curvature[up], 0, 1e-3);
      EXPECT_NEAR(p.curvature[1 - up], 1 / 0.3, 0.05);
      const double sign = p.along[up].z > 0 ? 1 : -1;
      EXPECT_NEAR(std::min(sign * p.from[up], sign * p.to[up]), -0.6 - z, 1e-3);
      EXPECT_NEAR(std::max(sign * p.from[up], sign * p.to[up]), 0.6 - z, 1e-3);
      EXPECT_GT(p.to[1 - up], 0.05);
      EXPECT_LT(p.from[1 - up], -0.05);
    }
  }
}

TEST(SpecularMesh, BesideTheEndOfACylinderItsEdgeIsAudible) {
  const Mesh mesh = make_cylinder(0.3, 1.2, segments_for(0.3));
  const std::vector<SpecularPoint> points = on_mesh(mesh, {2, 0.05, 0.63}, 0.02);
  ASSERT_FALSE(points.empty());
  const SpecularPoint& p = points[0];
  const std::size_t up = std::abs(p.along[0].z) > 0.5 ? 0 : 1;
  const double sign = p.along[up].z > 0 ? 1 : -1;
  EXPECT_NEAR(std::max(sign * p.from[up], sign * p.to[up]), -0.03, 1e-3);
  EXPECT_NEAR(std::min(sign * p.from[up], sign * p.to[up]), -1.23, 1e-3);
  EXPECT_NEAR(p.range_m, std::hypot(2, 0.05) - 0.3, 2e-3);
}

TEST(SpecularMesh, BoxIsSixFaces) {
  const Mesh mesh = make_box({0.6, 0.4, 0.8}, 0.25);
  const SpecularMesh mirrors(mesh, all_materials);
  EXPECT_EQ(mirrors.faces(), 6u);
  EXPECT_EQ(mirrors.curved_triangles(), 0u);
  const Vec3d sonar{2, 0.1, -0.2};
  const std::vector<SpecularPoint> points = on_mesh(mesh, sonar);
  ASSERT_EQ(points.size(), 2u);  // the back is hidden by the front; only rays determine this
  const std::vector<SpecularPoint> exact = on_primitive({.kind = Primitive::Kind::box, .size_m = {0.6, 0.4, 0.8}}, sonar);
  ASSERT_EQ(exact.size(), 1u);
  EXPECT_NEAR(points[0].range_m, exact[0].range_m, 1e-6);
  EXPECT_NEAR(length(points[0].foot_m - exact[0].foot_m), 0, 1e-6);
  EXPECT_EQ(points[0].outline.size(), 2u * (2 + 4));  // only the rim, divided into quarters of a metre
}

TEST(SpecularMesh, FacetsWoundTheOtherWayAreIncluded) {
  Mesh mesh = make_sphere(0.5, segments_for(0.5));
  for (std::size_t t = 0; t < mesh.triangles.size(); t += 3) std::swap(mesh.triangles[t][1], mesh.triangles[t][2]);
  const std::vector<SpecularPoint> points = on_mesh(mesh, {1, 2, 2});
  ASSERT_EQ(points.size(), 2u);
  EXPECT_NEAR(points[0].range_m, 2.5, 2e-4);
}

TEST(SpecularMesh, VerticesNeedNotBeShared) {
  Mesh mesh = make_cylinder(0.3, 1.2, segments_for(0.3)), loose;
  for (const auto& t : mesh.triangles) {
    const auto n = static_cast<std::uint32_t>(loose.vertices.size());
    for (const std::uint32_t v : t) loose.vertices.push_back(mesh.vertices[v]);
    loose.triangles.push_back({n, n + 1, n + 2});
    loose.material.push_back(0);
  }
  EXPECT_EQ(on_mesh(loose, {2, 0.1, 0.1}).size(), on_mesh(mesh, {2, 0.1, 0.1}).size());
}

TEST(SpecularMesh, UnwantedMaterialsAreLeftOut) {
  Mesh mesh = make_box({1, 1, 1});
  mesh.material[0] = mesh.material[1] = 1;  // the lower face along x
  EXPECT_EQ(SpecularMesh(mesh, {true, false}).faces(), 5u);
  EXPECT_EQ(SpecularMesh(mesh, {false, true}).faces(), 1u);
  EXPECT_EQ(SpecularMesh(mesh, {}).faces(), 0u);
}

// The frequency decides which of the two reflects. Therefore neither may be dropped as a duplicate of the other.
TEST(SpecularMesh, SurfacesOfTwoMaterialsAreNeverOne) {
  Mesh mesh = make_sphere(0.5, segments_for(0.5));
  const Mesh coat = make_sphere(0.5002, segments_for(0.5));
  const auto n = static_cast<std::uint32_t>(mesh.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), coat.vertices.begin(), coat.vertices.end());
  for (const auto& t : coat.triangles) {
    mesh.triangles.push_back({t[0] + n, t[1] + n, t[2] + n});
    mesh.material.push_back(1);
  }
  const auto near_points = [&](const std::vector<bool>& wanted) {
    std::vector<SpecularPoint> points;
    SpecularMesh(mesh, wanted).find({{2, 0.3, 0.1}, 1e-3, 2}, points);
    return points.size();
  };
  EXPECT_EQ(near_points({true, false}), 1u);
  EXPECT_EQ(near_points({false, true}), 1u);
  EXPECT_EQ(near_points({true, true}), 2u);
}

TEST(SpecularMesh, SmallAngleIsACurveLargeAngleAnEdge) {
  EXPECT_EQ(SpecularMesh(make_cylinder(0.3, 1, 36, Caps::none), all_materials).faces(), 0u);
  EXPECT_EQ(SpecularMesh(make_cylinder(0.3, 1, 8, Caps::none), all_materials).faces(), 8u);
}

TEST(SpecularMesh, AnEmptyMeshHasNoEcho) {
  EXPECT_TRUE(on_mesh({}, {1, 2, 3}).empty());
  EXPECT_TRUE(on_mesh(make_sphere(0.5, 32), {1000, 0, 0}).empty());  // beyond the requested range
}

TEST(SpecularPrimitives, TankIsAudibleFromInsideAndOutside) {
  const Primitive tank{.kind = Primitive::Kind::cylinder, .radius_m = 1, .size_m = {0, 0, 2}, .inside = true};
  const auto inside = on_primitive(tank, {0.3, 0, 0});
  ASSERT_EQ(inside.size(), 3u);  // wall in front, wall behind, floor; no lid
  EXPECT_NEAR(inside[0].range_m, 0.7, 1e-12);
  EXPECT_NEAR(inside[1].range_m, 1.3, 1e-12);
  EXPECT_NEAR(inside[0].curvature[0], -1, 1e-12);
  EXPECT_NEAR(inside[2].normal.z, 1, 1e-12);
  const auto outside = on_primitive(tank, {3, 0, 0});
  ASSERT_EQ(outside.size(), 1u);
  EXPECT_NEAR(outside[0].curvature[0], 1, 1e-12);
  const Primitive basin{.kind = Primitive::Kind::box, .size_m = {4, 4, 2}, .inside = true};
  EXPECT_EQ(on_primitive(basin, {0.5, 0.2, 0.1}).size(), 5u);
  EXPECT_EQ(on_primitive({}, {1, 0, 0}).size(), 0u);
}

}  // namespace
}  // namespace sonar
