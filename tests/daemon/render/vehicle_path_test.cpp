// Files of poses: both kinds mean the same, mistakes are told with their line, and the vehicle moves on between the lines.
#include "daemon/render/vehicle_path.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace sonar::render {
namespace {

using testing::HasSubstr;

std::vector<TimedPose> parsed(std::string_view text, PoseFrame asked = PoseFrame::enu_flu) {
  auto poses = parse_poses(text, "p.csv", asked);
  EXPECT_TRUE(poses) << (poses ? "" : poses.error().text);
  return poses.value_or(std::vector<TimedPose>{});
}
std::string refusal(std::string_view text) {
  const auto poses = parse_poses(text, "p.csv");
  return poses ? "accepted" : poses.error().text;
}
Vec3d ahead(const Pose& pose) { return rotate(pose.orientation, Vec3d{1, 0, 0}); }
void expect_near(Vec3d a, Vec3d b, double tolerance = 1e-9) {
  EXPECT_NEAR(a.x, b.x, tolerance);
  EXPECT_NEAR(a.y, b.y, tolerance);
  EXPECT_NEAR(a.z, b.z, tolerance);
}

TEST(PoseFile, AnglesAndQuaternionsAndTumSayTheSame) {
  const double half = std::sqrt(0.5);
  char quaternions[200], tum[200];
  std::snprintf(quaternions, sizeof quaternions, "t_s,x_m,y_m,z_m,qw,qx,qy,qz\n0.5,1,2,-3,%.17g,0,0,%.17g\n", half, half);
  std::snprintf(tum, sizeof tum, "# t x y z qx qy qz qw\n0.5 1 2 -3 0 0 %.17g %.17g\n", half, half);
  for (const std::string& text : {std::string("t,x,y,z,roll_deg,pitch_deg,yaw_deg\n0.5, 1, 2, -3, 0, 0, 90\r\n"),
                                  std::string("yaw,z,y,x,t\n90,-3,2,1,0.5\n"), std::string(quaternions), std::string(tum)}) {
    const auto poses = parsed(text);
    ASSERT_EQ(poses.size(), 1u);
    EXPECT_EQ(poses[0].time_s, 0.5);
    expect_near(poses[0].body_in_world.position_m, {1, 2, -3});
    expect_near(ahead(poses[0].body_in_world), {0, 1, 0});
  }
}

TEST(PoseFile, KnowsItsFrame) {
  const std::string line = "t,x,y,z,yaw_deg\n0,10,20,3,90\n";  // north 10, east 20, 3 deep, heading east
  for (const auto& poses : {parsed("# frame: NED_FRD\n" + line), parsed(line, PoseFrame::ned_frd),
                            parsed("# frame: NED_FRD\n" + line, PoseFrame::enu_flu)}) {
    expect_near(poses.at(0).body_in_world.position_m, {20, 10, -3});
    expect_near(ahead(poses.at(0).body_in_world), {1, 0, 0});
  }
  expect_near(parsed("# frame: ENU_FLU\n" + line, PoseFrame::ned_frd).at(0).body_in_world.position_m, {10, 20, 3});
}

TEST(PoseFile, TellsMistakesWithTheirLine) {
  EXPECT_THAT(refusal(""), HasSubstr("no poses"));
  EXPECT_THAT(refusal("t,x,y,z\n0,1,2\n"), HasSubstr("p.csv:2: 3 values instead of 4"));
  EXPECT_THAT(refusal("t,x,y,z\n0,1,2,3\n\n0,1,2,3\n"), HasSubstr("p.csv:4: the time does not rise"));
  EXPECT_THAT(refusal("t,x,y,z\n0,1,two,3\n"), HasSubstr("p.csv:2: \"two\" is not a number"));
  EXPECT_THAT(refusal("t,x,y,z\n0,1,nan,3\n"), HasSubstr("p.csv:2: \"nan\" is not a number"));
  EXPECT_THAT(refusal("t,x,y\n"), HasSubstr("p.csv:1: column z_m is missing"));
  EXPECT_THAT(refusal("t,x,y,z,yaw_dge\n"), HasSubstr("did you mean \"yaw_deg\""));
  EXPECT_THAT(refusal("t,x,y,z,x_m\n"), HasSubstr("stands twice"));
  EXPECT_THAT(refusal("t,x,y,z,qw\n"), HasSubstr("quaternion needs"));
  EXPECT_THAT(refusal("t,x,y,z,qw,qx,qy,qz,yaw\n"), HasSubstr("not both"));
  EXPECT_THAT(refusal("0 1 2 3 0 0 0 0.5\n"), HasSubstr("p.csv:1: the quaternion's norm is 0.5"));
  EXPECT_THAT(refusal("0 1 2 3\n"), HasSubstr("p.csv:1: 4 values instead of 8"));
  EXPECT_THAT(refusal("# frame: NWU\n"), HasSubstr("p.csv:1: the frame must be"));
  EXPECT_THAT(refusal("t,x,y,z\n0,1e9,2,3\n"), HasSubstr("beyond"));
}

TEST(PoseFile, ThatIsMissingIsSaidToBe) {
  const auto poses = load_poses("no-such-file.csv");
  ASSERT_FALSE(poses);
  EXPECT_EQ(poses.error().kind, ErrorKind::missing_file);
}

TEST(VehiclePath, GoesOnBetweenTheLinesAndTellsItsMotion) {
  const VehiclePath path{{}, false, parsed("t,x,y,z,yaw\n0,0,0,0,0\n2,1,0,0,90\n3,1,0,0,90\n")};
  expect_near(vehicle_at(path, 1).position_m, {0.5, 0, 0});
  expect_near(ahead(vehicle_at(path, 1)), {std::sqrt(0.5), std::sqrt(0.5), 0});
  expect_near(vehicle_at(path, -1).position_m, {0, 0, 0});
  expect_near(vehicle_at(path, 9).position_m, {1, 0, 0});
  const Twist moving = sonar_twist_at(path, {}, 1), resting = sonar_twist_at(path, {}, 3);
  expect_near(moving.velocity_mps, {0.5, 0, 0}, 1e-6);
  expect_near(moving.angular_rate_radps, {0, 0, pi / 4}, 1e-6);
  expect_near(resting.velocity_mps, {0, 0, 0}, 1e-6);
  // A sonar a metre ahead of the turning vehicle swings.
  const Twist swinging = sonar_twist_at(path, {{1, 0, 0}, {}}, 0);
  expect_near(swinging.velocity_mps, {0.5, pi / 4, 0}, 1e-3);
}

TEST(VehiclePath, RestsOrCircles) {
  const VehiclePath rest{{{1, 2, -3}, {}}, false, {}};
  expect_near(vehicle_at(rest, 100).position_m, {1, 2, -3});
  expect_near(sonar_twist_at(rest, {}, 5).velocity_mps, {0, 0, 0});
  const VehiclePath circle{{{6, 0, -3}, {}}, true, {}};
  expect_near(vehicle_at(circle, 0).position_m, {6, 0, -3});
  expect_near(ahead(vehicle_at(circle, 0)), {-1, 0, 0});
  expect_near(sonar_twist_at(circle, {}, 0).velocity_mps, {0, 0.5, 0}, 1e-3);
}

}  // namespace
}  // namespace sonar::render
