// Poses and motions between the points of a trajectory.
#include "core/motion/trajectory.hpp"

#include <gtest/gtest.h>

#include <random>

#include "core/base/units.hpp"

namespace sonar::motion {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

void expect_near(Vec3d a, Vec3d b, double tolerance = 1e-9) {
  EXPECT_NEAR(a.x, b.x, tolerance);
  EXPECT_NEAR(a.y, b.y, tolerance);
  EXPECT_NEAR(a.z, b.z, tolerance);
}
Quatd yawed(double deg) { return quat_from_rpy({0, 0, rad_from_deg(deg)}); }
Vec3d ahead(const Moment& m) { return rotate(m.body_in_world.orientation, Vec3d{1, 0, 0}); }

/// Moves ahead and turns to port for 2 s, then moves straight ahead for 1 s.
Points bend() {
  return {
      {seconds(1), seconds(3), seconds(4)}, {{{0, 0, 0}, yawed(0)}, {{1, 0, -2}, yawed(90)}, {{1, 3, -2}, yawed(90)}}, {}, {}};
}

TEST(Trajectory, GoesStraightAndTurnsEvenly) {
  const Trajectory way(bend());
  const Moment half = way.at(seconds(2));
  expect_near(half.body_in_world.position_m, {0.5, 0, -1});
  expect_near(ahead(half), {std::sqrt(0.5), std::sqrt(0.5), 0});
  expect_near(half.moves.velocity_mps, {0.5, 0, -1});
  expect_near(half.moves.angular_velocity_radps, {0, 0, pi / 4});
  expect_near(way.at(seconds(3)).moves.velocity_mps, {0, 3, 0});  // at a point: the motion of the next interval
  expect_near(way.at(seconds(4)).moves.velocity_mps, {0, 3, 0});  // at the last point: the motion of the previous interval
}

TEST(Trajectory, HoldsItsEnds) {
  const Trajectory way(bend(), seconds(10));
  EXPECT_EQ(way.duration(), seconds(10));
  expect_near(way.at(seconds(0)).body_in_world.position_m, {0, 0, 0});
  expect_near(way.at(seconds(0)).moves.velocity_mps, {0, 0, 0});
  expect_near(way.at(seconds(9)).body_in_world.position_m, {1, 3, -2});
  expect_near(way.at(seconds(9)).moves.velocity_mps, {0, 0, 0});
  const Trajectory one({{seconds(0)}, {{{1, 2, 3}, yawed(10)}}, {}, {}});
  expect_near(one.at(seconds(0)).body_in_world.position_m, {1, 2, 3});
  expect_near(one.at(seconds(5)).moves.velocity_mps, {0, 0, 0});
}

TEST(Trajectory, BelievesVelocitiesOfTheFile) {
  Points points = bend();
  points.velocities_mps = {{1, 0, 0}, {3, 0, 0}, {0, 0, 0}};
  points.angular_velocities_radps = {{0, 0, 1}, {0, 0, 2}, {0, 0, 0}};
  const Trajectory way(points);
  expect_near(way.at(seconds(2)).moves.velocity_mps, {2, 0, 0});
  expect_near(way.at(seconds(2)).moves.angular_velocity_radps, {0, 0, 1.5});
  expect_near(way.at(seconds(2)).body_in_world.position_m, {0.5, 0, -1});  // positions stay on the straight line
}

TEST(Trajectory, MotionIsThatOfItsPoses) {
  std::mt19937 dice(7);
  std::uniform_real_distribution<double> value(-1, 1);
  Points points;
  for (int i = 0; i < 50; ++i) {
    points.times.push_back(milliseconds(100 * i));
    points.poses.push_back({{value(dice), value(dice), value(dice)}, turned_by({value(dice), value(dice), value(dice)})});
  }
  const Trajectory way(points);
  const Ns step = std::chrono::microseconds(1);
  for (int i = 0; i < 49; ++i) {
    const Ns t = milliseconds(100 * i + 37);
    const Moment now = way.at(t), next = way.at(t + step);
    expect_near(now.moves.velocity_mps,
                1 / ::sonar::seconds(step) * (next.body_in_world.position_m - now.body_in_world.position_m), 1e-6);
    expect_near(now.moves.angular_velocity_radps,
                1 / ::sonar::seconds(step) * rotation_between(now.body_in_world.orientation, next.body_in_world.orientation),
                1e-4);
  }
}

TEST(Trajectory, TurnsTheShortWay) {
  const Quatd b = yawed(90);
  const Trajectory way({{seconds(0), seconds(1)}, {{{}, yawed(0)}, {{}, {-b.w, -b.x, -b.y, -b.z}}}, {}, {}});
  expect_near(ahead(way.at(milliseconds(500))), {std::sqrt(0.5), std::sqrt(0.5), 0});
}

TEST(Trajectory, EqualPosesAndStartsMakeItEqual) {
  Points other = bend();
  other.poses[1].position_m.z += 1e-12;
  EXPECT_TRUE(Trajectory(bend()) == Trajectory(bend()));
  EXPECT_FALSE(Trajectory(bend()) == Trajectory(other));
  EXPECT_FALSE(Trajectory(bend()) == Trajectory(bend(), seconds(5)));
}

}  // namespace
}  // namespace sonar::motion
