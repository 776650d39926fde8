// Compares rotations, poses and frame conversions with Eigen, which shares no code and no convention with ours.
#include "core/base/geometry.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>

namespace sonar {
namespace {

Eigen::Quaterniond eigen(Quatd q) { return {q.w, q.x, q.y, q.z}; }
Eigen::Vector3d eigen(Vec3d v) { return {v.x, v.y, v.z}; }
Eigen::Isometry3d eigen(const Pose& p) {
  Eigen::Isometry3d t = Eigen::Isometry3d::Identity();
  t.translate(eigen(p.position_m)).rotate(eigen(p.orientation));
  return t;
}

class Geometry : public testing::Test {
 protected:
  double number() { return uniform_(engine_); }
  Vec3d place() { return {10 * number(), 10 * number(), 10 * number()}; }
  Quatd turn() { return normalized({number(), number(), number(), number() + 1e-3}); }
  Pose pose() { return {place(), turn()}; }

 private:
  std::mt19937 engine_{20250};
  std::uniform_real_distribution<double> uniform_{-1, 1};
};

TEST_F(Geometry, QuaternionsRotateAndMultiply) {
  for (int i = 0; i < 100; ++i) {
    const Quatd a = turn(), b = turn();
    const Vec3d v = place();
    EXPECT_LT((eigen(rotate(a, v)) - eigen(a) * eigen(v)).norm(), 1e-12);
    EXPECT_LT((eigen(a * b).coeffs() - (eigen(a) * eigen(b)).coeffs()).norm(), 1e-12);
    const Rotation r = rotation_from(a);
    const Eigen::Matrix3d m = eigen(a).toRotationMatrix();
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) EXPECT_NEAR(r.m[row][column], m(row, column), 1e-12);
    }
  }
}

TEST_F(Geometry, PosesComposeAndInvert) {
  for (int i = 0; i < 100; ++i) {
    const Pose b_in_c = pose(), a_in_b = pose();
    EXPECT_TRUE(eigen(compose(b_in_c, a_in_b)).isApprox(eigen(b_in_c) * eigen(a_in_b), 1e-12));
    EXPECT_TRUE(eigen(inverse(a_in_b)).isApprox(eigen(a_in_b).inverse(), 1e-12));
    const Vec3d p = place();
    EXPECT_LT((eigen(transform(a_in_b, p)) - eigen(a_in_b) * eigen(p)).norm(), 1e-12);
  }
}

TEST_F(Geometry, RollPitchYawIsIntrinsicZYX) {
  for (int i = 0; i < 100; ++i) {
    const RollPitchYaw angles{3.1 * number(), 1.5 * number(), 3.1 * number()};
    const Eigen::Matrix3d expected = (Eigen::AngleAxisd(angles.yaw_rad, Eigen::Vector3d::UnitZ()) *
                                      Eigen::AngleAxisd(angles.pitch_rad, Eigen::Vector3d::UnitY()) *
                                      Eigen::AngleAxisd(angles.roll_rad, Eigen::Vector3d::UnitX()))
                                         .toRotationMatrix();
    const Quatd q = quat_from_rpy(angles);
    EXPECT_LT((eigen(q).toRotationMatrix() - expected).norm(), 1e-12);
    const RollPitchYaw back = rpy_from_quat(q);
    EXPECT_NEAR(back.roll_rad, angles.roll_rad, 1e-9);
    EXPECT_NEAR(back.pitch_rad, angles.pitch_rad, 1e-9);
    EXPECT_NEAR(back.yaw_rad, angles.yaw_rad, 1e-9);
  }
  EXPECT_NEAR(rpy_from_quat(quat_from_rpy({0, pi / 2, 0})).pitch_rad, pi / 2, 1e-7);  // at gimbal lock the result stays finite
}

// NED to ENU swaps the first two axes and reverses the third. FRD to FLU reverses the last two. The matrices of this
// test are independent of our quaternions.
TEST_F(Geometry, ConvertsToNorthEastDown) {
  Eigen::Matrix3d enu_from_ned_axes, flu_from_frd_axes;
  enu_from_ned_axes << 0, 1, 0, 1, 0, 0, 0, 0, -1;
  flu_from_frd_axes << 1, 0, 0, 0, -1, 0, 0, 0, -1;
  for (int i = 0; i < 100; ++i) {
    const Pose frd_in_ned = pose();
    const Pose flu_in_enu = enu_flu_from_ned_frd(frd_in_ned);
    EXPECT_LT((eigen(flu_in_enu.position_m) - enu_from_ned_axes * eigen(frd_in_ned.position_m)).norm(), 1e-12);
    const Eigen::Matrix3d expected =
        enu_from_ned_axes * eigen(frd_in_ned.orientation).toRotationMatrix() * flu_from_frd_axes.transpose();
    EXPECT_LT((eigen(flu_in_enu.orientation).toRotationMatrix() - expected).norm(), 1e-12);

    // A mount in the body's FRD axes has the same lever arm and rotation in its FLU axes.
    const Pose mount = flu_from_frd(frd_in_ned);
    EXPECT_LT((eigen(mount.position_m) - flu_from_frd_axes * eigen(frd_in_ned.position_m)).norm(), 1e-12);
    const Eigen::Matrix3d mount_expected =
        flu_from_frd_axes * eigen(frd_in_ned.orientation).toRotationMatrix() * flu_from_frd_axes.transpose();
    EXPECT_LT((eigen(mount.orientation).toRotationMatrix() - mount_expected).norm(), 1e-12);
    const Vec3d p = place();
    EXPECT_LT(length(enu_from_ned(enu_from_ned(p)) - p), 1e-15);
    EXPECT_LT(length(flu_from_frd(flu_from_frd(p)) - p), 1e-15);
  }
}

// A vehicle that heads east, with its nose 10 degrees up and its right side 20 degrees down, in ArduPilot's convention and in
// ours.
TEST_F(Geometry, AttitudesAgreeInBothConventions) {
  const Quatd frd_in_ned = quat_from_rpy({rad_from_deg(20), rad_from_deg(10), rad_from_deg(90)});
  const Quatd flu_in_enu = enu_flu_from_ned_frd(frd_in_ned);
  EXPECT_NEAR(deg_from_rad(heading_rad(flu_in_enu)), 90, 1e-9);
  const RollPitchYaw ours = rpy_from_quat(flu_in_enu);
  EXPECT_NEAR(deg_from_rad(ours.roll_rad), 20, 1e-9);
  EXPECT_NEAR(deg_from_rad(ours.pitch_rad), -10, 1e-9);  // about the port axis: nose up is negative
  EXPECT_NEAR(deg_from_rad(ours.yaw_rad), 0, 1e-9);      // along +x, east
  const Vec3d ahead = rotate(flu_in_enu, {1, 0, 0}), port = rotate(flu_in_enu, {0, 1, 0});
  EXPECT_GT(ahead.x, 0.9);
  EXPECT_NEAR(ahead.z, std::sin(rad_from_deg(10)), 1e-12);
  EXPECT_GT(port.y, 0.9);
  EXPECT_GT(port.z, 0.3);
}

TEST_F(Geometry, HeadingRunsClockwiseFromNorth) {
  EXPECT_NEAR(heading_rad(quat_from_rpy({0, 0, pi / 2})), 0, 1e-12);
  EXPECT_NEAR(heading_rad(quat_from_rpy({0, 0, 0})), pi / 2, 1e-12);
  EXPECT_NEAR(heading_rad(quat_from_rpy({0, 0, -pi / 2})), pi, 1e-12);
  EXPECT_NEAR(heading_rad(quat_from_rpy({0, 0, pi})), 1.5 * pi, 1e-12);
}

TEST_F(Geometry, OnlyFiniteNumbersPassTheCheck) {
  EXPECT_TRUE(is_finite(Vec3d{1, 2, 3}));
  EXPECT_FALSE(is_finite(Vec3d{1, std::nan(""), 3}));
  EXPECT_FALSE(is_finite(Quatd{HUGE_VAL, 0, 0, 0}));
}

}  // namespace
}  // namespace sonar
