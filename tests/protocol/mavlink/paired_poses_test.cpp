// Tests the pairing of a position with the attitude of the same moment: the attitude is interpolated or briefly extrapolated, or
// the position waits for it, or it is missing.
#include "protocol/mavlink/paired_poses.hpp"

#include "tests/protocol/mavlink/mavlink_testing.hpp"

namespace sonar::mavlink {
namespace {

AttitudeReading turned(std::int64_t at_ms, double yaw_rad, double rate_radps = 0) {
  return {at_ms, quat_from_rpy({0, 0, yaw_rad}), {0, 0, rate_radps}};
}
double yaw_of(const AttitudeReading& a) { return rpy_from_quat(a.frd_in_ned).yaw_rad; }
PlaceReading place(std::int64_t at_ms) { return {at_ms, {static_cast<double>(at_ms), 0, 0}, {}}; }

TEST(MavlinkPairs, AttitudesAreInterpolatedTheShortWay) {
  Attitudes all;
  all.put(turned(1000, 3.0, 0.1));
  all.put(turned(1100, -3.0, 0.3));  // across south
  AttitudeReading at;
  ASSERT_EQ(all.at(1050, at), Attitudes::Answer::known);
  EXPECT_NEAR(std::abs(yaw_of(at)), pi, 1e-6);
  EXPECT_NEAR(at.rates_radps.z, 0.2, 1e-12);
  AttitudeReading flipped = turned(1200, -3.0);
  flipped.frd_in_ned = {-flipped.frd_in_ned.w, -flipped.frd_in_ned.x, -flipped.frd_in_ned.y, -flipped.frd_in_ned.z};
  all.put(flipped);
  ASSERT_EQ(all.at(1150, at), Attitudes::Answer::known);
  EXPECT_NEAR(yaw_of(at), -3.0, 1e-9) << "a quaternion and its negative are one attitude";
}

TEST(MavlinkPairs, TheNewestAttitudeIsExtrapolatedForAShortTime) {
  Attitudes all;
  all.put(turned(1000, 1.0, 0.5));
  AttitudeReading at;
  ASSERT_EQ(all.at(1020, at), Attitudes::Answer::known);
  EXPECT_NEAR(yaw_of(at), 1.01, 1e-9);
  EXPECT_EQ(all.at(1021, at), Attitudes::Answer::later);
  all.put(turned(2100, 1.0));
  EXPECT_EQ(all.at(1500, at), Attitudes::Answer::never) << "attitudes were missing for more than a second";
  EXPECT_EQ(all.at(999, at), Attitudes::Answer::never) << "before the first attitude";
}

TEST(MavlinkPairs, LateAttitudesChangeNothingAndThoseOfAnEqualTimeReplace) {
  Attitudes all;
  all.put(turned(1000, 1.0));
  all.put(turned(900, 2.0));
  all.put(turned(1000, 1.5));
  AttitudeReading at;
  ASSERT_EQ(all.at(1000, at), Attitudes::Answer::known);
  EXPECT_NEAR(yaw_of(at), 1.5, 1e-9);
}

TEST(MavlinkPairs, PlacesWaitForTheNextAttitudeInOrder) {
  Attitudes all;
  PairedPlaces<PlaceReading> pairs;
  pairs.put(place(1000));
  EXPECT_FALSE(pairs.next(all));
  all.put(turned(990, 0));
  EXPECT_TRUE(pairs.next(all));
  pairs.put(place(1100));
  pairs.put(place(1200));
  EXPECT_FALSE(pairs.next(all));
  all.put(turned(1190, 0.2));
  const auto first = pairs.next(all), second = pairs.next(all);
  ASSERT_TRUE(first && second);
  EXPECT_NEAR(yaw_of(first->attitude), 0.11, 1e-5);
  EXPECT_EQ(second->place.ned_m.x, 1200);
  EXPECT_FALSE(pairs.next(all));
}

TEST(MavlinkPairs, TheNumberOfWaitingPlacesIsLimited) {
  Attitudes all;
  PairedPlaces<PlaceReading> pairs;
  for (int i = 0; i < 1000; ++i) pairs.put(place(1000 + 10 * i));
  for (int i = 0; i <= 1000; ++i) all.put(turned(1000 + 10 * i, 0));
  int paired = 0;
  while (pairs.next(all)) ++paired;
  EXPECT_EQ(paired, 16);
}

}  // namespace
}  // namespace sonar::mavlink
