// Compares interpolated, extrapolated and held poses with closed forms.
#include "daemon/emulator/world/world.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace sonar::pose_history_test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
const Time t0 = Time(std::chrono::hours(5));
constexpr std::chrono::nanoseconds limit = milliseconds(200);

Pose pose(double x, double yaw_deg = 0) { return {{x, 0, -3}, quat_from_rpy({0, 0, rad_from_deg(yaw_deg)})}; }
double yaw_deg(const Pose& p) { return deg_from_rad(rpy_from_quat(p.orientation).yaw_rad); }

TEST(PoseHistory, InterpolatesPositionAndOrientation) {
  PoseHistory h;
  h.put({t0, pose(0, 0), {}, {}});
  h.put({t0 + milliseconds(100), pose(1, 40), {}, {}});
  const Pose p = h.at(t0 + milliseconds(25), limit);
  EXPECT_NEAR(p.position_m.x, 0.25, 1e-12);
  EXPECT_NEAR(yaw_deg(p), 10, 1e-9);
  EXPECT_NEAR(norm_squared(p.orientation), 1, 1e-12);
}

TEST(PoseHistory, TurnsTheShortWay) {
  PoseHistory h;
  h.put({t0, pose(0, 170), {}, {}});
  h.put({t0 + milliseconds(100), pose(0, -170), {}, {}});
  EXPECT_NEAR(std::abs(yaw_deg(h.at(t0 + milliseconds(50), limit))), 180, 1e-9);
  Pose negative = pose(0, -170);  // the same orientation written with the other sign
  negative.orientation = {-negative.orientation.w, -negative.orientation.x, -negative.orientation.y, -negative.orientation.z};
  h.put({t0 + milliseconds(100), negative, {}, {}});
  EXPECT_NEAR(std::abs(yaw_deg(h.at(t0 + milliseconds(50), limit))), 180, 1e-9);
}

TEST(PoseHistory, ExtrapolatesByTheLastTwoSamplesThenHolds) {
  PoseHistory h;
  h.put({t0, pose(0, 0), {}, {}});
  h.put({t0 + milliseconds(100), pose(1, 10), {}, {}});
  const Pose ahead = h.at(t0 + milliseconds(200), limit);
  EXPECT_NEAR(ahead.position_m.x, 2, 1e-12);
  EXPECT_NEAR(yaw_deg(ahead), 20, 1e-9);
  const Pose at_limit = h.at(t0 + milliseconds(300), limit);
  const Pose later = h.at(t0 + seconds(30), limit);
  EXPECT_NEAR(at_limit.position_m.x, 3, 1e-12);
  EXPECT_EQ(later.position_m.x, at_limit.position_m.x);
}

TEST(PoseHistory, GivenVelocitiesInBodyAxesReplaceDifferences) {
  PoseHistory h;
  h.put({t0, pose(0, 90), {}, {}});
  h.put({t0 + milliseconds(100), pose(1, 90), Vec3d{2, 0, 0}, Vec3d{0, 0, 1}});  // ahead of a body that looks along +y
  const Pose p = h.at(t0 + milliseconds(200), limit);
  EXPECT_NEAR(p.position_m.x, 1, 1e-12);
  EXPECT_NEAR(p.position_m.y, 0.2, 1e-12);
  EXPECT_NEAR(yaw_deg(p), 90 + deg_from_rad(0.1), 1e-9);
}

TEST(PoseHistory, OneSampleHoldsAndSoDoesTheTimeBeforeTheFirst) {
  PoseHistory h;
  h.put({t0, pose(7), {}, {}});
  EXPECT_EQ(h.at(t0 - seconds(9), limit).position_m.x, 7);
  EXPECT_EQ(h.at(t0 + milliseconds(150), limit).position_m.x, 7);
}

TEST(PoseHistory, SamplesMicrosecondsApartGiveNoSpeed) {
  PoseHistory h;
  h.put({t0, pose(0), {}, {}});
  h.put({t0 + std::chrono::microseconds(3), pose(0.01), {}, {}});
  EXPECT_EQ(h.at(t0 + milliseconds(100), limit).position_m.x, 0.01);
}

TEST(PoseHistory, AJumpIsNotExtrapolated) {
  PoseHistory placed;  // 400 m/s
  placed.put({t0, pose(0), {}, {}});
  placed.put({t0 + milliseconds(50), pose(20), {}, {}});
  EXPECT_EQ(placed.at(t0 + milliseconds(150), limit).position_m.x, 20);
  EXPECT_EQ(placed.motion_at(t0 + milliseconds(150), limit).velocity_mps.x, 0);
  PoseHistory turned;  // 180 degrees in 0.1 s
  turned.put({t0, pose(0, 0), {}, {}});
  turned.put({t0 + milliseconds(100), pose(1, 180), {}, {}});
  EXPECT_NEAR(std::abs(yaw_deg(turned.at(t0 + milliseconds(200), limit))), 180, 1e-9);
  PoseHistory thrown;  // a stated velocity is used nevertheless
  thrown.put({t0, pose(0), {}, {}});
  thrown.put({t0 + milliseconds(50), pose(20), Vec3d{1, 0, 0}, {}});
  EXPECT_NEAR(thrown.at(t0 + milliseconds(150), limit).position_m.x, 20.1, 1e-12);
}

TEST(PoseHistory, EqualTimesReplaceAndOldSamplesGo) {
  PoseHistory h;
  h.put({t0, pose(1), {}, {}});
  h.put({t0, pose(2), {}, {}});
  EXPECT_EQ(h.size(), 1u);
  EXPECT_EQ(h.newest().pose.position_m.x, 2);
  for (int i = 1; i <= 600; ++i) h.put({t0 + milliseconds(10 * i), pose(i), {}, {}});
  EXPECT_LE(h.size(), 202u);
  EXPECT_NEAR(h.at(t0 + milliseconds(4005), limit).position_m.x, 400.5, 1e-9);
}

TEST(PoseHistory, TheNewestCanBeReplacedByALaterOne) {
  PoseHistory h;
  h.put({t0, pose(0), {}, {}});
  h.put({t0 + milliseconds(10), pose(1), {}, {}});
  h.replace_newest({t0 + milliseconds(20), pose(4), {}, {}});
  EXPECT_EQ(h.size(), 2u);
  EXPECT_NEAR(h.at(t0 + milliseconds(10), limit).position_m.x, 2, 1e-12);
}

TEST(PoseHistory, StaysBoundedAtAnyRate) {
  PoseHistory h;
  for (int i = 0; i < 10000; ++i) h.put({t0 + std::chrono::microseconds(i), pose(i), {}, {}});
  EXPECT_LE(h.size(), PoseHistory::most_samples);
}

TEST(PoseHistory, MotionBelongsToTheReturnedPose) {
  PoseHistory h;
  h.put({t0, pose(0, 0), {}, {}});
  h.put({t0 + milliseconds(100), pose(1, 10), {}, {}});
  h.put({t0 + milliseconds(200), pose(1, 30), {}, {}});
  const auto motion = [&](int ms) { return h.motion_at(t0 + milliseconds(ms), limit); };
  EXPECT_NEAR(motion(50).velocity_mps.x, 10, 1e-9);
  EXPECT_NEAR(motion(50).angular_velocity_radps.z, rad_from_deg(100), 1e-9);
  EXPECT_NEAR(motion(100).velocity_mps.x, 0, 1e-9) << "the motion after that pose";
  EXPECT_NEAR(motion(200).angular_velocity_radps.z, rad_from_deg(200), 1e-9);
  EXPECT_NEAR(motion(390).angular_velocity_radps.z, rad_from_deg(200), 1e-9) << "the rate is extrapolated";
  EXPECT_EQ(length(motion(401).angular_velocity_radps), 0) << "the last pose is held";
  EXPECT_EQ(length(motion(-1).velocity_mps), 0) << "before the first pose";
  // Compares the motion with the change of the pose in 10 ms.
  for (const int ms : {20, 120, 250}) {
    const Time t = t0 + milliseconds(ms), later = t + milliseconds(10);
    const Vec3d moved = h.at(later, limit).position_m - h.at(t, limit).position_m;
    EXPECT_NEAR(length(moved - 0.01 * motion(ms).velocity_mps), 0, 1e-9) << ms;
  }
}

TEST(PoseHistory, GivenVelocitiesAreTheMotionBeyondTheNewest) {
  PoseHistory h;
  h.put({t0, pose(0, 90), Vec3d{2, 0, 0}, Vec3d{0.1, 0, 1}});
  const PoseHistory::Motion m = h.motion_at(t0 + milliseconds(20), limit);
  EXPECT_NEAR(m.velocity_mps.x, 0, 1e-12);
  EXPECT_NEAR(m.velocity_mps.y, 2, 1e-12) << "the velocity has world axes";
  EXPECT_NEAR(m.angular_velocity_radps.x, 0.1, 1e-12) << "the angular velocity has body axes";
}

}  // namespace
}  // namespace sonar::pose_history_test
