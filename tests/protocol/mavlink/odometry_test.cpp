// Tests that messages that state the same pose in different frames give the same pose.
#include "tests/protocol/mavlink/mavlink_testing.hpp"

namespace sonar::mavlink {
namespace {

constexpr std::uint8_t ned = 1, enu = 4, body_frd = 12, body_flu = 13, frd = 20, flu = 21;

control::PoseSample sample_of(const Result<control::RawPose>& raw) {
  if (!raw) ADD_FAILURE() << raw.error().text;
  const auto sample = control::checked({}, raw.value_or(control::RawPose{}));
  if (!sample) ADD_FAILURE() << sample.error().text;
  return sample.value_or(control::PoseSample{});
}
Odometry with(std::uint8_t frame, std::uint8_t child, Vec3 at, Quatd q, Vec3 velocity, Vec3 rates) {
  Odometry m;
  m.frame_id = frame, m.child_frame_id = child;
  m.x_m = at.x, m.y_m = at.y, m.z_m = at.z;
  m.wxyz = {static_cast<float>(q.w), static_cast<float>(q.x), static_cast<float>(q.y), static_cast<float>(q.z)};
  m.vx_mps = velocity.x, m.vy_mps = velocity.y, m.vz_mps = velocity.z;
  m.roll_radps = rates.x, m.pitch_radps = rates.y, m.yaw_radps = rates.z;
  return m;
}
Quatd about_z(double angle_rad) { return turned_by({0, 0, angle_rad}); }

/// Expects 10 m north, 2 m east, 3 m down, heading east; the vehicle moves ahead and to port, its bow rises and turns to
/// starboard.
void expect_the_vehicle(const control::PoseSample& s) {
  expect_near(s.pose.position_m, {2, 10, -3}, 1e-6);
  expect_axes(s.pose, {1, 0, 0}, {0, 1, 0});
  ASSERT_TRUE(s.velocity_mps && s.angular_velocity_radps);
  expect_near(*s.velocity_mps, {1, 0.5, 0}, 1e-6);
  expect_near(*s.angular_velocity_radps, {0, -0.1, -0.2}, 1e-6);
}

TEST(MavlinkOdometry, EveryPairOfFramesGivesTheSamePose) {
  const double quarter = pi / 2;
  const Vec3 moves_frd{1, -0.5f, 0}, turns_frd{0, 0.1f, 0.2f}, moves_flu{1, 0.5f, 0}, turns_flu{0, -0.1f, -0.2f};
  const auto sent = [](auto... parts) { return sample_of(raw_pose(with(parts...))); };
  expect_the_vehicle(sent(ned, body_frd, Vec3{10, 2, 3}, about_z(quarter), moves_frd, turns_frd));
  expect_the_vehicle(sent(frd, body_frd, Vec3{10, 2, 3}, about_z(quarter), moves_frd, turns_frd));
  expect_the_vehicle(sent(ned, ned, Vec3{10, 2, 3}, about_z(quarter), Vec3{0.5f, 1, 0}, turns_frd));
  expect_the_vehicle(sent(enu, body_flu, Vec3{2, 10, -3}, Quatd{}, moves_flu, turns_flu));
  expect_the_vehicle(sent(enu, body_frd, Vec3{2, 10, -3}, Quatd{0, 1, 0, 0}, moves_frd, turns_frd));
  expect_the_vehicle(sent(flu, body_flu, Vec3{10, -2, -3}, about_z(-quarter), moves_flu, turns_flu));
  for (const auto old_ned :
       std::initializer_list<std::uint8_t>{14, 16, 18}) {  // frames of older senders, described in common.xml
    expect_the_vehicle(sent(old_ned, body_frd, Vec3{10, 2, 3}, about_z(quarter), moves_frd, turns_frd));
    expect_the_vehicle(sent(old_ned, old_ned, Vec3{10, 2, 3}, about_z(quarter), Vec3{0.5f, 1, 0}, turns_frd));
  }
  for (const auto old_enu : std::initializer_list<std::uint8_t>{15, 17, 19})
    expect_the_vehicle(sent(old_enu, body_flu, Vec3{2, 10, -3}, Quatd{}, moves_flu, turns_flu));
  for (const auto old_body : std::initializer_list<std::uint8_t>{8, 9})
    expect_the_vehicle(sent(ned, old_body, Vec3{10, 2, 3}, about_z(quarter), moves_frd, turns_frd));
}

TEST(MavlinkOdometry, UnknownFramesAreRefusedByName) {
  const auto refused = [](std::uint8_t frame, std::uint8_t child) {
    const auto pose = raw_pose(with(frame, child, {}, {}, {}, {}));
    return pose ? "" : pose.error().text;
  };
  EXPECT_THAT(refused(7, body_frd), ::testing::StartsWith("frame_id 7 (LOCAL_OFFSET_NED) is not served"));
  EXPECT_THAT(refused(body_frd, body_frd), ::testing::StartsWith("frame_id 12 (BODY_FRD) is not served"));
  EXPECT_THAT(refused(22, body_frd), ::testing::StartsWith("frame_id 22 is not served"));
  EXPECT_THAT(refused(ned, 0), ::testing::StartsWith("child_frame_id 0 (GLOBAL) is not served"));
  EXPECT_THAT(refused(enu, enu), ::testing::StartsWith("child_frame_id 4 (LOCAL_ENU) is not served"));
  EXPECT_THAT(refused(flu, flu), ::testing::StartsWith("child_frame_id 21 (LOCAL_FLU) is not served"));
}

TEST(MavlinkOdometry, UnknownVelocitiesAreLeftOut) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const auto raw = raw_pose(with(ned, body_frd, {1, 2, 3}, {}, {nan, 0, 0}, {0, 0, nan}));
  ASSERT_TRUE(raw);
  EXPECT_FALSE(raw->velocity_mps || raw->angular_velocity_radps);
}

TEST(MavlinkReadings, AttitudesByAnglesAndByQuaternionAgree) {
  Attitude angles;
  angles.roll_rad = 0.1f, angles.pitch_rad = 0.2f, angles.yaw_rad = static_cast<float>(pi / 2);
  const auto by_angles = sample_of(raw_pose(attitude_of(angles), place_of(local(0, 1, 2, 3))));
  // Heading east, bow up, starboard down: positive pitch and roll of forward-right-down.
  const Vec3d ahead = rotate(by_angles.pose.orientation, {1, 0, 0}), port = rotate(by_angles.pose.orientation, {0, 1, 0});
  EXPECT_NEAR(std::asin(ahead.z), 0.2, 1e-6);
  EXPECT_GT(ahead.x, 0.9);
  EXPECT_GT(port.z, 0.05);
  const Quatd q = quat_from_rpy({0.1, 0.2, pi / 2});
  AttitudeQuaternion m;
  m.w = static_cast<float>(q.w), m.x = static_cast<float>(q.x), m.y = static_cast<float>(q.y), m.z = static_cast<float>(q.z);
  m.offset = {0.5f, 0.5f, 0.5f, 0.5f};
  const auto by_quaternion = sample_of(raw_pose(attitude_of(m), place_of(local(0, 1, 2, 3))));
  expect_axes(by_quaternion.pose, ahead, port, 1e-6);
}

TEST(MavlinkReadings, TheVelocityOfAPositionIsRotatedIntoBodyAxes) {
  LocalPositionNed m = local(0, 0, 0, 0);
  m.north_mps = 2, m.down_mps = -1;
  const auto s = sample_of(raw_pose(attitude_of(attitude(0, static_cast<float>(pi / 2))), place_of(m)));
  expect_near(*s.velocity_mps, {0, 2, 1}, 1e-6);  // heading east, moving north and up: to port and up
}

TEST(MavlinkReadings, SimStateWithoutAQuaternionHasAngles) {
  SimState m;
  m.w = m.x = m.y = m.z = 0;
  m.yaw_rad = static_cast<float>(pi / 2);
  expect_axes(sample_of(raw_pose(m)).pose, {1, 0, 0}, {0, 1, 0});
}

TEST(MavlinkReadings, IntegersHavePriorityOverFloatsAndZeroMeansUnknown) {
  SimState m;
  EXPECT_FALSE(*geodetic_of(m));
  m.latitude_deg = 47.6f, m.longitude_deg = -122.33f;
  EXPECT_NEAR(deg_from_rad((*geodetic_of(m))->latitude_rad), 47.6, 1e-5);
  EXPECT_FALSE(has_exact_position(m));
  m.latitude_e7_deg = 476000001, m.longitude_e7_deg = -1223300001;
  EXPECT_NEAR(deg_from_rad((*geodetic_of(m))->latitude_rad), 47.6000001, 1e-12);
  m.latitude_e7_deg = 900000001;
  EXPECT_FALSE(geodetic_of(m)) << "beyond the pole";
}

}  // namespace
}  // namespace sonar::mavlink
