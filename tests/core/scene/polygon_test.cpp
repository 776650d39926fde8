#include "core/scene/shapes/polygon.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace sonar {
namespace {

// Vector area of a set of triangles, and the sum of their plain areas. The lengths are equal if no triangles overlap or are
// reversed.
std::pair<Vec3d, double> areas(const std::vector<Vec3d>& p) {
  Vec3d sum;
  double plain = 0;
  for (const auto& t : triangulate(p)) {
    const Vec3d n = 0.5 * cross(p[t[1]] - p[t[0]], p[t[2]] - p[t[0]]);
    sum = sum + n;
    plain += length(n);
  }
  return {sum, plain};
}

TEST(Polygon, ConcavePolygonsAreTriangulatedWithoutOverlap) {
  const std::vector<Vec3d> l{{0, 0, 0}, {3, 0, 0}, {3, 1, 0}, {1, 1, 0}, {1, 3, 0}, {0, 3, 0}};
  EXPECT_EQ(triangulate(l).size(), 4u);
  EXPECT_NEAR(areas(l).first.z, 5, 1e-12);
  EXPECT_NEAR(areas(l).second, 5, 1e-12);
  for (const Quatd q :
       {Quatd{0.5, 0.5, 0.5, 0.5}, Quatd{0.5, -0.5, 0.5, -0.5}, Quatd{0, 1, 0, 0}, normalized(Quatd{1, 2, 3, 4})}) {
    for (std::size_t first = 0; first < l.size(); ++first) {
      std::vector<Vec3d> turned;
      for (std::size_t i = 0; i < l.size(); ++i) turned.push_back(rotate(q, l[(i + first) % l.size()]));
      EXPECT_NEAR(length(areas(turned).first - rotate(q, {0, 0, 5})), 0, 1e-9);
      EXPECT_NEAR(areas(turned).second, 5, 1e-9);
    }
  }
}

TEST(Polygon, AStarOfManyCornersIsTriangulated) {
  std::vector<Vec3d> star;
  for (int i = 0; i < 100; ++i) {
    const double r = i % 2 ? 1.0 : 2.5, a = 2 * pi * i / 100;
    star.push_back({0, r * std::cos(a), r * std::sin(a)});
  }
  EXPECT_EQ(triangulate(star).size(), 98u);
  EXPECT_NEAR(length(areas(star).first), areas(star).second, 1e-9);
}

TEST(Polygon, DegeneratePolygonsGiveTheRightCount) {
  EXPECT_TRUE(triangulate({}).empty());
  const std::vector<Vec3d> line{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}};
  EXPECT_EQ(triangulate(line).size(), 2u);
  const std::vector<Vec3d> bow{{0, 0, 0}, {1, 1, 0}, {1, 0, 0}, {0, 1, 0}};
  EXPECT_EQ(triangulate(bow).size(), 2u);
  EXPECT_EQ(triangulate(std::vector<Vec3d>(1000)).size(), 998u);
  EXPECT_EQ(triangulate(std::vector<Vec3d>(5, Vec3d{std::nan(""), 0, 0})).size(), 3u);
}

}  // namespace
}  // namespace sonar
