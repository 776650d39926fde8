// Stamps become time with `clock: follow`: one clock, several clocks, restarts, jumps, and malicious stamps.
#include <gtest/gtest.h>

#include "daemon/emulator/world/world.hpp"

namespace sonar {
namespace {

using control::ClockDomain;
using control::PoseSample;
using std::chrono::milliseconds;
using std::chrono::nanoseconds;
using std::chrono::seconds;

struct Follows : ::testing::Test {
  static PoseRules rules() {
    PoseRules r;
    r.stepped = r.follows = true;
    return r;
  }
  PoseVerdict take(const std::string& name, nanoseconds stamp, double x = 0, PoseSample::Of of = PoseSample::Of::vehicle) {
    PoseSample s;
    s.of = of;
    s.name = name;
    s.pose.position_m = {x, 0, -3};
    s.stamp = {ClockDomain::sim, stamp.count()};
    const PoseVerdict verdict = world.accept(s, {"test " + name, "test"}, now).verdict;
    now += world.take_skipped();
    if (const auto until = world.followed_until()) now = std::max(now, *until);
    return verdict;
  }
  World world{rules(), {{"a", {}, false}, {"b", {}, false}}, {{"crate", {}, false}}, Time{}};
  Time now{};
};

TEST_F(Follows, TimeDoesNotPassBeforeTheFirstPose) {
  EXPECT_FALSE(world.followed_until());
  EXPECT_EQ(take("crate", seconds(5), 0, PoseSample::Of::object), PoseVerdict::accepted);
  EXPECT_FALSE(world.followed_until()) << "objects do not make time pass";
}

TEST_F(Follows, TimeFollowsTheSlowerOfTwoVehicles) {
  take("a", seconds(100));
  EXPECT_EQ(now, Time(seconds(100)));
  take("b", seconds(100));
  take("a", seconds(100) + milliseconds(300));
  EXPECT_EQ(world.followed_until(), Time(seconds(100)));
  take("b", seconds(100) + milliseconds(200));
  EXPECT_EQ(now, Time(seconds(100) + milliseconds(200)));
}

TEST_F(Follows, AVehicleThatFellSilentDelaysNoOther) {
  take("a", seconds(100));
  take("b", seconds(100));
  for (int i = 1; i <= 12; ++i) take("a", seconds(100) + i * milliseconds(100));
  EXPECT_EQ(now, Time(seconds(101) + milliseconds(200)));
  EXPECT_TRUE(world.is_stale(1, now));
  EXPECT_FALSE(world.is_stale(0, now));
  take("b", seconds(101) + milliseconds(200), 7);
  EXPECT_EQ(now, Time(seconds(101) + milliseconds(200)));
  EXPECT_EQ(world.vehicle_at(1, now).position_m.x, 7) << "vehicle b continues with the same clock";
}

TEST_F(Follows, TwoClocksAreBothFollowed) {
  take("a", seconds(1000));
  for (int i = 0; i <= 10; ++i) {
    take("b", seconds(5) + i * milliseconds(100), i);
    take("a", seconds(1000) + i * milliseconds(100));
  }
  EXPECT_EQ(now, Time(seconds(1001)));
  EXPECT_EQ(world.vehicle_at(1, Time(seconds(1000) + milliseconds(450))).position_m.x, 4.5);
}

TEST_F(Follows, TimeContinuesForAllVehiclesOfARestartedSimulator) {
  for (const char* name : {"a", "b"}) take(name, seconds(500));
  for (const char* name : {"a", "b"}) EXPECT_EQ(take(name, milliseconds(0)), PoseVerdict::accepted);
  EXPECT_EQ(now, Time(seconds(500)));
  for (const char* name : {"a", "b"}) take(name, milliseconds(400));
  EXPECT_EQ(now, Time(seconds(500) + milliseconds(400)));
}

TEST_F(Follows, ALatePoseIsNotMistakenForARestart) {
  take("a", seconds(10));
  EXPECT_EQ(take("a", seconds(10) - milliseconds(20)), PoseVerdict::late);
  EXPECT_EQ(now, Time(seconds(10)));
}

TEST_F(Follows, ObjectsShareTheVehiclesClock) {
  take("crate", seconds(100), 1, PoseSample::Of::object);
  take("a", seconds(100));
  take("crate", seconds(100) + milliseconds(100), 2, PoseSample::Of::object);
  take("a", seconds(100) + milliseconds(100));
  EXPECT_EQ(world.object_at(0, now).position_m.x, 2);
}

TEST_F(Follows, OrbitsDoNotMoveWhileTimeIsSkipped) {
  World orbits(rules(), {{"a", {}, false}, {"b", {{5, 0, -3}, {}}, true}}, {}, Time{});
  PoseSample s;
  s.name = "a";
  s.stamp = {ClockDomain::sim, nanoseconds(seconds(1'700'000'000)).count()};
  orbits.accept(s, {"test", "test"}, Time{});
  EXPECT_EQ(orbits.take_skipped(), seconds(1'700'000'000));
  EXPECT_EQ(orbits.take_skipped().count(), 0) << "skipped time is returned once";
  EXPECT_NEAR(orbits.vehicle_at(1, Time(seconds(1'700'000'000))).position_m.x, 5, 1e-9);
}

TEST_F(Follows, StampsAtTheEndsOfTimeDoNoHarm) {
  const nanoseconds most(control::largest_stamp_ns);
  for (const nanoseconds stamp : {-most, most, nanoseconds(0), most, -most, most - nanoseconds(1), -most}) {
    take("a", stamp);
    take("b", -stamp);
    EXPECT_GE(now, Time{});
    EXPECT_LE(now, Time(most));
  }
  EXPECT_EQ(take("a", seconds(1)), PoseVerdict::accepted);
}

}  // namespace
}  // namespace sonar
