// Bodies that follow trajectories: their places and motion, which other senders may move them, and control by requests.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "daemon/emulator/world/world.hpp"

namespace sonar::world_trajectory_test {
namespace {

using control::PoseSample;
using control::SetTrajectory;
using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::HasSubstr;

const Time t0 = Time(std::chrono::hours(400000));

/// Returns a trajectory of 10 s to the east at 1 m/s from x = 0, with a quarter turn to port.
motion::Plan east(motion::PlaybackRules rules = {}, double z_m = -3) {
  motion::Points points{{seconds(0), seconds(10)}, {{{0, 0, z_m}, {}}, {{10, 0, z_m}, quat_from_rpy({0, 0, pi / 2})}}, {}, {}};
  return {std::make_shared<const motion::Trajectory>(std::move(points)), rules, "east.tum", "east.tum: 10 s"};
}
BodyStart rov(motion::Plan plan = east()) { return {"rov", {{99, 0, 0}, {}}, false, std::move(plan)}; }
World with_rov(motion::PlaybackRules rules = {}) { return World({}, {rov(east(rules))}, {}, t0); }
double x_at(const World& w, double s) { return w.vehicle_at(0, t0 + nanoseconds_from(s)).position_m.x; }
double speed_at(const World& w, double s) { return w.vehicle_moves(0, t0 + nanoseconds_from(s)).velocity_mps.x; }
SetTrajectory asked(std::optional<bool> paused, std::optional<double> position_s = {}, std::optional<double> speed = {}) {
  return {PoseSample::Of::vehicle, "rov", paused, position_s, speed};
}

TEST(WorldTrajectory, IsFollowedWithItsMotion) {
  const World w = with_rov();
  EXPECT_EQ(w.source_of(0), "trajectory east.tum");
  EXPECT_EQ(x_at(w, 0), 0);
  EXPECT_EQ(x_at(w, 2.5), 2.5);
  EXPECT_NEAR(deg_from_rad(heading_rad(w.vehicle_at(0, t0 + seconds(5)).orientation)), 45, 1e-9);
  EXPECT_DOUBLE_EQ(speed_at(w, 2.5), 1);
  EXPECT_NEAR(w.vehicle_moves(0, t0 + seconds(1)).angular_velocity_radps.z, pi / 20, 1e-12);
  EXPECT_EQ(x_at(w, 60), 10);
  EXPECT_EQ(speed_at(w, 60), 0) << "the vehicle rests at the end";
}

TEST(WorldTrajectory, TheVelocityGrowsWithThePlaybackSpeed) {
  const World w = with_rov({*motion::Speed::from(4), true, seconds(2)});
  EXPECT_EQ(x_at(w, 1), 6);
  EXPECT_DOUBLE_EQ(speed_at(w, 1), 4);
  EXPECT_EQ(x_at(w, 2.5), 2) << "the second pass of the loop";
}

TEST(WorldTrajectory, GivesWayToTheFirstPose) {
  World w = with_rov();
  PoseSample pose;
  pose.pose.position_m = {-5, 0, 0};
  EXPECT_THAT(w.accept(pose, {"a", "json 127.0.0.1"}, t0 + seconds(1)).notice, HasSubstr("trajectory east.tum -> json"));
  EXPECT_EQ(x_at(w, 1), -5);
  EXPECT_FALSE(w.vehicle_plays(0));
  EXPECT_THAT(w.steer(asked(true), t0 + seconds(2)), HasSubstr("moved by poses from json 127.0.0.1"));
  EXPECT_EQ(x_at(w, 30), -5) << "the trajectory does not continue";
}

TEST(WorldTrajectory, IsControlledByRequests) {
  World w = with_rov();
  EXPECT_EQ(w.steer(asked(true), t0 + seconds(3)), "");
  EXPECT_EQ(x_at(w, 8), 3);
  EXPECT_EQ(speed_at(w, 8), 0);
  EXPECT_TRUE(w.vehicle_plays(0)->playback.paused());
  EXPECT_EQ(w.steer(asked(true), t0 + seconds(9)), "") << "a second pause is no mistake";
  EXPECT_EQ(w.steer(asked(false, 6, 2), t0 + seconds(10)), "");
  EXPECT_EQ(x_at(w, 11), 8);
  const auto played = w.vehicle_plays(0);
  ASSERT_TRUE(played);
  EXPECT_EQ(played->file, "east.tum");
  EXPECT_EQ(played->playback.place(t0 + seconds(11)).at, seconds(8));
  EXPECT_EQ(played->playback.duration(), seconds(10));
  EXPECT_EQ(played->playback.rules().speed.factor(), 2);
  EXPECT_FALSE(played->playback.paused() || played->playback.rules().loop);
}

TEST(WorldTrajectory, RefusalsHaveAReason) {
  World w = with_rov();
  EXPECT_THAT(w.steer(asked({}), t0), HasSubstr("give at least one of"));
  EXPECT_THAT(w.steer(asked({}, 10.5), t0), HasSubstr("from 0 to 10"));
  EXPECT_THAT(w.steer(asked({}, -1), t0), HasSubstr("from 0 to 10"));
  EXPECT_THAT(w.steer(asked({}, 5, 0), t0), HasSubstr("0.001 to 1000"));
  EXPECT_EQ(x_at(w, 0), 0) << "refused requests change nothing";
  SetTrajectory other = asked(true);
  other.name = "auv";
  EXPECT_THAT(w.steer(other, t0), HasSubstr("no vehicle is called \"auv\"; known: rov"));
  other.of = PoseSample::Of::object;
  EXPECT_THAT(w.steer(other, t0), HasSubstr("no moving object"));
  World still({}, {{"rov", {}, false}}, {}, t0);
  EXPECT_THAT(still.steer(asked(true), t0), HasSubstr("rov follows no trajectory"));
  EXPECT_FALSE(still.vehicle_plays(0));
}

TEST(WorldTrajectory, ContinuesAfterAReloadThatDoesNotChangeIt) {
  World w = with_rov();
  w.steer(asked({}, {}, 2), t0 + seconds(1));
  w.use_vehicles({{"buoy", {}, false}, rov()}, t0 + seconds(2));  // read again: the same points at another address
  EXPECT_EQ(w.vehicle_at(1, t0 + seconds(3)).position_m.x, 5);
  w.use_vehicles({rov(east({*motion::Speed::from(3), false, seconds(0)}))}, t0 + seconds(4));
  EXPECT_EQ(x_at(w, 5), 3) << "a trajectory with another speed begins anew";
  w.use_vehicles({rov(east({}, -4))}, t0 + seconds(6));
  EXPECT_EQ(x_at(w, 6), 0) << "the trajectory of another file begins anew";
  w.use_vehicles({{"rov", {{99, 0, 0}, {}}, false}}, t0 + seconds(7));
  EXPECT_EQ(x_at(w, 7), 99);
  EXPECT_EQ(w.source_of(0), "initial pose");
}

TEST(WorldTrajectory, ObjectsFollowTrajectoriesToo) {
  World w({}, {{"rov", {}, false}}, {{"crate", {}, false, {}}, {"buoy", {}, false, east()}}, t0);
  EXPECT_EQ(w.objects_at(t0 + seconds(4)).at(1).position_m.x, 4);
  EXPECT_EQ(w.steer({PoseSample::Of::object, "buoy", true, 7, {}}, t0 + seconds(5)), "");
  EXPECT_EQ(w.object_at(1, t0 + seconds(9)).position_m.x, 7);
  EXPECT_EQ(w.object_plays(1)->playback.place(t0 + seconds(9)).at, seconds(7));
  EXPECT_FALSE(w.object_plays(0));
  w.hide(1, true);
  EXPECT_GT(w.object_at(1, t0).position_m.z, 1000);
}

}  // namespace
}  // namespace sonar::world_trajectory_test
