// Tests the paths of `sonarctl pose`: places, directions and speeds at times where they are known.
#include "clients/sonarctl/pose.hpp"

#include <gtest/gtest.h>

namespace sonar::clients {
namespace {

void expect_near(Vec3d a, Vec3d b, double tolerance = 1e-9) {
  EXPECT_NEAR(a.x, b.x, tolerance);
  EXPECT_NEAR(a.y, b.y, tolerance);
  EXPECT_NEAR(a.z, b.z, tolerance);
}
Vec3d ahead(const Pose& pose) { return rotate(pose.orientation, Vec3d{1, 0, 0}); }

TEST(Circle, StartsEastLooksAtItsCentreAndTurnsAnticlockwise) {
  const Circle circle{{1, 2, -3}, 4, 40, 0, true};
  expect_near(on_circle(circle, 0).body_in_world.position_m, {5, 2, -3});
  expect_near(ahead(on_circle(circle, 0).body_in_world), {-1, 0, 0});
  expect_near(on_circle(circle, 10).body_in_world.position_m, {1, 6, -3});
  expect_near(ahead(on_circle(circle, 10).body_in_world), {0, -1, 0});
}

TEST(Circle, LooksAlongThePathInBothDirections) {
  for (const double period_s : {40.0, -40.0}) {
    const Circle circle{{0, 0, 0}, 4, period_s, 0, false};
    const double h = 1e-6;
    const Moment now = on_circle(circle, 7), soon = on_circle(circle, 7 + h);
    const Vec3d moved = (1 / h) * (soon.body_in_world.position_m - now.body_in_world.position_m);
    expect_near(now.velocity_mps, moved, 1e-5);
    EXPECT_NEAR(dot(ahead(now.body_in_world), moved) / length(moved), 1, 1e-6);
  }
}

TEST(Circle, PitchesTheBowUp) {
  const Circle circle{{0, 0, 0}, 4, 40, 0.2, true};
  EXPECT_NEAR(ahead(on_circle(circle, 3).body_in_world).z, std::sin(0.2), 1e-9);
}

TEST(Line, RunsFromItsStartToItsEndAndStays) {
  const Line line{{0, -8, -4}, {0, 8, -4}, 0.5, 0};
  EXPECT_DOUBLE_EQ(line.duration_s(), 32);
  expect_near(on_line(line, 16).body_in_world.position_m, {0, 0, -4});
  expect_near(on_line(line, 16).velocity_mps, {0, 0.5, 0});
  expect_near(ahead(on_line(line, 16).body_in_world), {0, 1, 0});
  expect_near(on_line(line, 99).body_in_world.position_m, {0, 8, -4});
  expect_near(on_line(line, 99).velocity_mps, {0, 0, 0});
}

TEST(Line, ALineWithoutLengthStandsStill) {
  expect_near(on_line({{1, 1, 1}, {1, 1, 1}, 1, 0}, 5).body_in_world.position_m, {1, 1, 1});
}

}  // namespace
}  // namespace sonar::clients
