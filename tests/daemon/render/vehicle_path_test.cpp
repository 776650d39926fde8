// The vehicle of a rendered ping: rests, circles, or follows a file in the file's own time.
#include "daemon/commands/render/vehicle_path.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace sonar::render {
namespace {

using testing::HasSubstr;

VehiclePath path_of(std::string_view text, const std::string& body = {}) {
  const auto file = motion::parse_trajectories(text, "p.csv", {.frame = motion::Frame::enu_flu});
  EXPECT_TRUE(file) << (file ? "" : file.error().text);
  return file ? path_in(*file, "p.csv", body).value_or(VehiclePath{}) : VehiclePath{};
}
Time at(double s) { return Time{} + nanoseconds_from(s); }
Vec3d ahead(const Pose& pose) { return rotate(pose.orientation, Vec3d{1, 0, 0}); }
void expect_near(Vec3d a, Vec3d b, double tolerance = 1e-9) {
  EXPECT_NEAR(a.x, b.x, tolerance);
  EXPECT_NEAR(a.y, b.y, tolerance);
  EXPECT_NEAR(a.z, b.z, tolerance);
}

TEST(VehiclePath, GoesOnBetweenTheLinesAndTellsItsMotion) {
  const VehiclePath path = path_of("t,x,y,z,yaw\n0,0,0,0,0\n2,1,0,0,90\n3,1,0,0,90\n");
  expect_near(vehicle_at(path, at(1)).position_m, {0.5, 0, 0});
  expect_near(ahead(vehicle_at(path, at(1))), {std::sqrt(0.5), std::sqrt(0.5), 0});
  expect_near(vehicle_at(path, at(-1)).position_m, {0, 0, 0});
  expect_near(vehicle_at(path, at(9)).position_m, {1, 0, 0});
  const Twist moving = sonar_twist_at(path, {}, at(1)), resting = sonar_twist_at(path, {}, at(3));
  expect_near(moving.velocity_mps, {0.5, 0, 0}, 1e-12);
  expect_near(moving.angular_rate_radps, {0, 0, pi / 4}, 1e-12);
  expect_near(resting.velocity_mps, {0, 0, 0}, 1e-12);
  // A sonar a metre ahead of the turning vehicle swings.
  const Twist swinging = sonar_twist_at(path, {{1, 0, 0}, {}}, at(0));
  expect_near(swinging.velocity_mps, {0.5, pi / 4, 0}, 1e-12);
}

TEST(VehiclePath, AJumpBetweenLinesIsNoMotion) {
  VehiclePath path = path_of("t,x,y,z,yaw\n0,0,0,0,0\n1,29,0,0,0\n2,60,0,0,0\n2.1,60,0,0,90\n3,60,0,0,90\n");
  path.snapshots = false;  // as by --motion on
  expect_near(sonar_twist_at(path, {}, at(0.5)).velocity_mps, {29, 0, 0});
  const Twist far = sonar_twist_at(path, {{1, 0, 0}, {}}, at(1.5)), turned = sonar_twist_at(path, {{1, 0, 0}, {}}, at(2.05));
  expect_near(far.velocity_mps, {0, 0, 0});
  expect_near(turned.velocity_mps, {0, 0, 0});
  expect_near(turned.angular_rate_radps, {0, 0, 0});
  expect_near(vehicle_at(path, at(1.5)).position_m, {44.5, 0, 0});  // where it is stays what the lines say
}

std::string lines_of(int count, double step_m, double turn_deg, double period_s = 1) {
  std::string text = "t,x,y,z,yaw\n";
  for (int i = 0; i < count; ++i)
    text += std::to_string(i * period_s) + "," + std::to_string(i * step_m) + ",0,0," + std::to_string(i * turn_deg) + "\n";
  return text;
}

TEST(VehiclePath, PosesFurtherApartThanAVehicleGoesAreSnapshotsAndNoMotion) {
  struct Step {
    double step_m, turn_deg, period_s;
  };
  for (const auto& [step_m, turn_deg, period_s] : {Step{15.1, 0, 1}, Step{0, 144, 0.5}, Step{5, 0, 0.033}}) {
    const VehiclePath path = path_of(lines_of(5, step_m, turn_deg, period_s));
    EXPECT_TRUE(path.snapshots) << step_m << " " << turn_deg;
    const Twist rests = sonar_twist_at(path, {{1, 0, 0}, {}}, at(2 * period_s));
    EXPECT_EQ(length(rests.velocity_mps) + length(rests.angular_rate_radps), 0) << step_m << " " << turn_deg;
    expect_near(vehicle_at(path, at(2 * period_s)).position_m, {2 * step_m, 0, 0});  // where it is stays what the lines say
  }
  for (const auto& [step_m, turn_deg, period_s] : {Step{14.9, 0, 1}, Step{6.2, 0, 1}, Step{0, 143, 0.5}, Step{1, 45, 1}}) {
    const VehiclePath path = path_of(lines_of(5, step_m, turn_deg, period_s));
    EXPECT_FALSE(path.snapshots) << step_m << " " << turn_deg;
    EXPECT_GT(length(sonar_twist_at(path, {{1, 0, 0}, {}}, at(2 * period_s)).velocity_mps), 0) << step_m << " " << turn_deg;
  }
}

TEST(VehiclePath, TheJitterOfAFastLogIsNoRowOfSnapshots) {
  std::string text = "t,x,y,z,yaw\n";
  for (int i = 0; i <= 100; ++i)
    text += std::to_string(0.01 * i) + "," + std::to_string(0.015 * i + (i % 3 == 0 ? 0.2 : 0)) + ",0,0," +
            std::to_string(i % 2 == 0 ? 6 : 0) + "\n";
  const VehiclePath path = path_of(text);  // line to line 20 m/s and 10 rad/s
  EXPECT_FALSE(path.snapshots);
  EXPECT_EQ(steps_of(*path.trajectory).all, 10u);
  EXPECT_TRUE(path_of("t,x,y,z\n0,0,0,0\n0.01,3,0,0\n").snapshots) << "a file that is shorter than a step has one";
}

TEST(VehiclePath, AMissionWithAFewJumpsIsNoRowOfSnapshots) {
  const std::string slow = lines_of(20, 1, 0);  // 19 steps
  EXPECT_FALSE(path_of(slow + "20,40,0,0,0\n").snapshots) << "1 of 20 steps";
  EXPECT_FALSE(path_of(slow + "20,40,0,0,0\n21,80,0,0,0\n").snapshots) << "2 of 21";
  EXPECT_TRUE(path_of(slow + "20,40,0,0,0\n21,80,0,0,0\n22,120,0,0,0\n").snapshots) << "3 of 22";
  EXPECT_THAT(note_of_snapshots(path_of("t,x,y,z\n0,0,0,0\n1,20,0,0\n2,21,0,0\n")), HasSubstr("1 of 2 steps"));
}

TEST(VehiclePath, AFileThatTellsVelocitiesIsTakenAtItsWord) {
  EXPECT_FALSE(path_of("t,x,y,z,vx,vy,vz\n0,0,0,0,20,0,0\n1,20,0,0,20,0,0\n2,40,0,0,20,0,0\n").snapshots);
  EXPECT_TRUE(path_of("t,x,y,z\n0,0,0,0\n1,20,0,0\n2,40,0,0\n").snapshots);
}

TEST(VehiclePath, KeepsTheTimesOfItsFile) {
  const VehiclePath path = path_of("1403636579.763555584 1 0 0 0 0 0 1\n1403636580.763555584 3 0 0 0 0 0 1\n");
  const std::vector<Time> times = times_of(path);
  ASSERT_EQ(times.size(), 2u);
  EXPECT_EQ(times[0].time_since_epoch().count(), 1403636579763555584);
  expect_near(vehicle_at(path, times[0]).position_m, {1, 0, 0});
  expect_near(vehicle_at(path, times[1]).position_m, {3, 0, 0});
  expect_near(sonar_twist_at(path, {}, times[1]).velocity_mps, {2, 0, 0});  // it arrives moving
  EXPECT_TRUE(times_of(VehiclePath{}).empty());
}

TEST(VehiclePath, IsThatOfOneBody) {
  const std::string two = "body,t,x,y,z\nrov,10,0,0,0\nbuoy,12,5,5,0\nbuoy,14,5,6,0\n";
  const VehiclePath buoy = path_of(two, "buoy");
  EXPECT_EQ(times_of(buoy), (std::vector<Time>{at(12), at(14)}));
  expect_near(vehicle_at(buoy, at(13)).position_m, {5, 5.5, 0});
  const auto file = motion::parse_trajectories(two, "p.csv", {.frame = motion::Frame::enu_flu});
  EXPECT_THAT(path_in(*file, "p.csv", {}).error().text, HasSubstr("several bodies"));
}

TEST(VehiclePath, RestsOrCircles) {
  const VehiclePath rest{{{1, 2, -3}, {}}, false, {}, {}};
  expect_near(vehicle_at(rest, at(100)).position_m, {1, 2, -3});
  expect_near(sonar_twist_at(rest, {}, at(5)).velocity_mps, {0, 0, 0});
  const VehiclePath circle{{{6, 0, -3}, {}}, true, {}, {}};
  expect_near(vehicle_at(circle, at(0)).position_m, {6, 0, -3});
  expect_near(ahead(vehicle_at(circle, at(0))), {-1, 0, 0});
  expect_near(sonar_twist_at(circle, {}, at(0)).velocity_mps, {0, 0.5, 0}, 1e-12);
}

}  // namespace
}  // namespace sonar::render
