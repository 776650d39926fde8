// Which senders and times of poses are accepted, and the pose at a time: the rules of docs/poses.md, "Time and order".
#include "daemon/emulator/world/world.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace sonar::world_test {
namespace {

using control::ClockDomain;
using control::PoseSample;
using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::HasSubstr;

const Time t0 = Time(std::chrono::hours(400000));
const Sender udp{"protobuf udp 127.0.0.1:4000", "protobuf 127.0.0.1"};
const Sender json{"json udp 127.0.0.1:5000", "json 127.0.0.1"};

PoseSample at_x(double x, std::uint64_t seq = 0) {
  PoseSample s;
  s.seq = seq;
  s.pose.position_m = {x, 0, -3};
  return s;
}
PoseSample stamped(double x, ClockDomain domain, std::chrono::nanoseconds t, std::uint64_t seq = 0) {
  PoseSample s = at_x(x, seq);
  s.stamp = {domain, t.count()};
  return s;
}
World one_rov(PoseRules rules = {}, bool orbits = false) { return World(rules, {{"rov", {{0, 0, -3}, {}}, orbits}}, {}, t0); }

TEST(World, RestsAtTheInitialPoseUntilTheFirstPose) {
  World w = one_rov();
  EXPECT_EQ(w.vehicle_at(0, t0 + seconds(100)).position_m.z, -3);
  EXPECT_FALSE(w.is_stale(0, t0 + seconds(100)));
  EXPECT_EQ(w.source_of(0), "initial pose");
}

TEST(World, OrbitsTheOriginLookingInwardUntilTheFirstPose) {
  World w(PoseRules{}, {{"rov", {{0, -8, -2}, {}}, true}}, {}, t0);
  const Pose start = w.vehicle_at(0, t0);
  EXPECT_NEAR(start.position_m.y, -8, 1e-9);
  for (const int s : {0, 10, 50}) {
    const Pose p = w.vehicle_at(0, t0 + seconds(s));
    EXPECT_NEAR(std::hypot(p.position_m.x, p.position_m.y), 8, 1e-9);
    EXPECT_EQ(p.position_m.z, -2);
    const Vec3d ahead = rotate(p.orientation, {1, 0, 0});
    EXPECT_NEAR(ahead.x * p.position_m.x + ahead.y * p.position_m.y, -8, 1e-9) << "the vehicle looks at the z axis";
  }
  EXPECT_GT(length(w.vehicle_at(0, t0 + seconds(2)).position_m - start.position_m), 0.5);
  const auto outcome = w.accept(at_x(1), json, t0);
  EXPECT_THAT(outcome.notice, HasSubstr("demo orbit -> json 127.0.0.1"));
  EXPECT_EQ(w.vehicle_at(0, t0 + seconds(9)).position_m.x, 1);
}

TEST(World, TheNoticeNamesFieldsAndFrame) {
  World w = one_rov();
  PoseSample s = at_x(1);
  s.fields = "timestamp position attitude velocity";
  s.sent_in = control::Frame::ned_frd;
  EXPECT_EQ(w.accept(s, json, t0).notice,
            "pose source of rov changed: initial pose -> json 127.0.0.1; fields: timestamp position attitude velocity (NED/FRD)");
  EXPECT_EQ(w.accept(s, json, t0 + milliseconds(10)).notice, "");
}

TEST(World, ArrivalTimeInterpolates) {
  World w = one_rov();
  w.accept(at_x(0), udp, t0);
  w.accept(at_x(1), udp, t0 + milliseconds(100));
  EXPECT_NEAR(w.vehicle_at(0, t0 + milliseconds(50)).position_m.x, 0.5, 1e-12);
  EXPECT_NEAR(w.vehicle_at(0, t0 + milliseconds(150)).position_m.x, 1.5, 1e-12);
}

TEST(World, OldSequenceNumbersAreLate) {
  World w = one_rov();
  w.accept(at_x(0, 10), udp, t0);
  w.accept(at_x(1, 12), udp, t0 + milliseconds(10));
  EXPECT_EQ(w.accept(at_x(9, 11), udp, t0 + milliseconds(20)).verdict, PoseVerdict::late);
  EXPECT_EQ(w.accept(at_x(9, 12), udp, t0 + milliseconds(30)).verdict, PoseVerdict::late);
  EXPECT_EQ(w.counters().late, 2u);
  EXPECT_EQ(w.accept(at_x(2, 13), udp, t0 + milliseconds(40)).verdict, PoseVerdict::accepted);
  EXPECT_EQ(w.counters().accepted, 3u);
}

TEST(World, ARestartedSenderIsAcceptedFromANewPortOrAfterSilence) {
  World w = one_rov();
  w.accept(at_x(0, 1000), udp, t0);
  EXPECT_EQ(w.accept(at_x(1, 1), udp, t0 + milliseconds(900)).verdict, PoseVerdict::late);
  EXPECT_EQ(w.accept(at_x(1, 1), {"protobuf udp 127.0.0.1:4001", "protobuf 127.0.0.1"}, t0 + milliseconds(950)).verdict,
            PoseVerdict::accepted);
  EXPECT_EQ(w.accept(at_x(2, 1), {"protobuf udp 127.0.0.1:4001", "protobuf 127.0.0.1"}, t0 + milliseconds(2000)).verdict,
            PoseVerdict::accepted);
  EXPECT_EQ(w.counters().histories, 3u);
}

TEST(World, ANewSenderDoesNotInterpolateWithTheOldOne) {
  World w = one_rov();
  w.accept(at_x(0), udp, t0);
  w.accept(at_x(10), json, t0 + milliseconds(100));
  EXPECT_EQ(w.vehicle_at(0, t0 + milliseconds(50)).position_m.x, 10);
  EXPECT_EQ(w.vehicle_at(0, t0 + milliseconds(200)).position_m.x, 10) << "poses of two senders give no speed";
}

TEST(World, SenderClockIsMappedByTheLeastDelay) {
  World w = one_rov();
  w.accept(stamped(0, ClockDomain::sim, milliseconds(5000)), json, t0 + milliseconds(40));   // 40 ms under way
  w.accept(stamped(1, ClockDomain::sim, milliseconds(5100)), json, t0 + milliseconds(110));  // 10 ms under way
  w.accept(stamped(2, ClockDomain::sim, milliseconds(5200)), json, t0 + milliseconds(250));  // 50 ms under way
  EXPECT_NEAR(w.vehicle_at(0, t0 + milliseconds(160)).position_m.x, 1.5, 1e-9)
      << "5150 ms of the sender's clock are 160 ms of ours";
}

TEST(World, TheFarthestStampsOverflowNothing) {  // the undefined-behaviour sanitizer checks this
  World w = one_rov();
  const std::chrono::nanoseconds far(control::largest_stamp_ns);
  EXPECT_EQ(w.accept(stamped(1, ClockDomain::sim, -far), json, t0).verdict, PoseVerdict::accepted);
  EXPECT_EQ(w.accept(stamped(2, ClockDomain::sim, far), json, t0 + milliseconds(10)).verdict, PoseVerdict::accepted);
  EXPECT_EQ(w.vehicle_at(0, t0 + milliseconds(10)).position_m.x, 2);
  EXPECT_EQ(w.accept(stamped(3, ClockDomain::sim, -far), udp, t0 + milliseconds(20)).verdict, PoseVerdict::accepted);
  EXPECT_EQ(w.vehicle_at(0, t0 + milliseconds(20)).position_m.x, 3);
  for (const auto t : {-far, far})
    EXPECT_EQ(w.accept(stamped(4, ClockDomain::wall, t), udp, t0 + milliseconds(30)).verdict, PoseVerdict::bad_time);
}

TEST(World, ASlowSimulatorIsFollowedInSteps) {
  World w = one_rov();
  for (int i = 0; i <= 100; ++i)  // half real time
    w.accept(stamped(0.01 * i, ClockDomain::sim, milliseconds(50 * i)), json, t0 + milliseconds(100 * i));
  const double x = w.vehicle_at(0, t0 + milliseconds(10000)).position_m.x;
  EXPECT_NEAR(x, 1.0, 0.05) << "never more than the extrapolation limit away from the newest pose";
}

TEST(World, EqualStampsReplaceAndOlderOnesAreLate) {
  World w = one_rov();
  w.accept(stamped(1, ClockDomain::sim, seconds(1)), json, t0);
  w.accept(stamped(2, ClockDomain::sim, seconds(1)), json, t0 + milliseconds(10));
  EXPECT_EQ(w.counters().replaced, 1u);
  EXPECT_EQ(w.vehicle_at(0, t0 + milliseconds(10)).position_m.x, 2);
  EXPECT_EQ(w.accept(stamped(3, ClockDomain::sim, milliseconds(999)), json, t0 + milliseconds(20)).verdict, PoseVerdict::late);
}

TEST(World, ASendersClockThatIsSetBackStartsANewHistory) {
  for (const bool stepped : {false, true}) {
    PoseRules rules;
    rules.stepped = stepped;
    World w = one_rov(rules);
    w.accept(stamped(1, ClockDomain::sim, seconds(7200)), json, t0);
    EXPECT_EQ(w.accept(stamped(2, ClockDomain::sim, seconds(7199)), json, t0 + milliseconds(10)).verdict, PoseVerdict::late);
    EXPECT_EQ(w.accept(stamped(3, ClockDomain::sim, milliseconds(7198999)), json, t0 + milliseconds(20)).verdict,
              PoseVerdict::accepted);
    EXPECT_EQ(w.vehicle_at(0, t0 + milliseconds(20)).position_m.x, 3);
    EXPECT_EQ(w.accept(stamped(4, ClockDomain::sim, seconds(10)), json, t0 + milliseconds(30)).verdict, PoseVerdict::accepted);
    EXPECT_EQ(w.vehicle_at(0, t0 + milliseconds(30)).position_m.x, 4);
    EXPECT_EQ(w.counters().late, 1u);
  }
}

TEST(World, WallStampsMustAgreeWithOurClock) {
  World w = one_rov();
  const auto now = t0.time_since_epoch();
  EXPECT_EQ(w.accept(stamped(1, ClockDomain::wall, now - milliseconds(50)), udp, t0).verdict, PoseVerdict::accepted);
  const auto future = w.accept(stamped(1, ClockDomain::wall, now + seconds(10)), udp, t0);
  EXPECT_EQ(future.verdict, PoseVerdict::bad_time);
  EXPECT_THAT(future.refusal, HasSubstr("synchronise the clocks"));
  EXPECT_EQ(w.accept(stamped(1, ClockDomain::wall, now - seconds(10)), udp, t0).verdict, PoseVerdict::bad_time);
  EXPECT_EQ(w.counters().refused, 2u);
}

TEST(World, InSteppedTimeWallStampsAreTheSendersOwnClock) {
  PoseRules rules;
  rules.stepped = true;
  World w = one_rov(rules);
  EXPECT_EQ(w.accept(stamped(1, ClockDomain::wall, std::chrono::hours(480000)), udp, Time{}).verdict, PoseVerdict::accepted);
  EXPECT_EQ(w.vehicle_at(0, Time{}).position_m.x, 1);
}

TEST(World, AChangedResetCounterOrAJumpClearsTheHistory) {
  World w = one_rov();
  w.accept(at_x(0, 1), udp, t0);
  w.accept(at_x(1, 2), udp, t0 + milliseconds(100));
  PoseSample reset = at_x(5, 1);  // the counter may start again with a reset
  reset.reset_counter = 1;
  EXPECT_EQ(w.accept(reset, udp, t0 + milliseconds(200)).verdict, PoseVerdict::accepted);
  EXPECT_EQ(w.vehicle_at(0, t0 + milliseconds(150)).position_m.x, 5);
  EXPECT_EQ(w.counters().resets, 1u);
  PoseSample far = at_x(60, 2);
  far.reset_counter = 1;
  EXPECT_THAT(w.accept(far, udp, t0 + milliseconds(300)).notice, HasSubstr("max_jump_m"));
  EXPECT_EQ(w.counters().jumps, 1u);
  EXPECT_EQ(w.vehicle_at(0, t0 + milliseconds(400)).position_m.x, 60) << "no extrapolation across the jump";
}

TEST(World, AVehicleWithoutNewsRestsAtItsNewestPose) {
  World w = one_rov();
  w.accept(at_x(0, 1), udp, t0);
  w.accept(at_x(1, 2), udp, t0 + milliseconds(100));
  EXPECT_NEAR(w.vehicle_at(0, t0 + milliseconds(1000)).position_m.x, 3, 1e-9) << "extrapolated for 0.2 s, then held";
  EXPECT_EQ(w.vehicle_at(0, t0 + milliseconds(1101)).position_m.x, 1) << "stale";
  EXPECT_EQ(length(w.vehicle_moves(0, t0 + milliseconds(1101)).velocity_mps), 0);
  EXPECT_NEAR(w.vehicle_at(0, t0 + milliseconds(300)).position_m.x, 3, 1e-9) << "earlier times stay as they were";
}

TEST(World, TwoAlternatingSendersAreReportedOnce) {
  const Sender one{"json udp 127.0.0.1:40001", "json 127.0.0.1"}, other{"json udp 127.0.0.1:40002", "json 127.0.0.1"};
  World w = one_rov();
  std::vector<std::string> notices;
  const auto sent = [&](const Sender& sender, int ms) {
    const std::string notice = w.accept(stamped(1, ClockDomain::arrival, {}), sender, t0 + milliseconds(ms)).notice;
    if (notice.find("in turns") != std::string::npos) notices.push_back(notice);
  };
  for (int i = 0; i < 20; ++i) sent(i % 2 == 0 ? one : other, 50 * i);
  ASSERT_EQ(notices.size(), 1u);
  EXPECT_THAT(notices[0], AllOf(HasSubstr(one.id), HasSubstr(other.id)));
  sent(one, 5000);  // a program that starts again has another port and is not a second sender
  sent(other, 5100);
  EXPECT_EQ(notices.size(), 1u);
  sent(one, 5200);
  EXPECT_EQ(notices.size(), 2u);
}

TEST(World, PosesBeyondOneKilohertzReplaceTheNewestAndAreCounted) {
  PoseRules rules;
  rules.burst = 4;
  World w = one_rov(rules);
  const auto sent = [](int i) { return stamped(0.001 * i, ClockDomain::sim, std::chrono::microseconds(100 * i)); };  // 10 kHz
  for (int i = 0; i <= 1000; ++i) {
    const Time now = t0 + std::chrono::microseconds(100 * i);
    EXPECT_EQ(w.accept(sent(i), json, now).verdict, PoseVerdict::accepted);
    ASSERT_NEAR(w.vehicle_at(0, now).position_m.x, 0.001 * i, 1e-12) << "the newest pose is used";
  }
  EXPECT_EQ(w.counters().accepted, 1001u);
  EXPECT_NEAR(static_cast<double>(w.counters().over_rate), 1001 - 4 - 100, 2) << "100 ms at 1 kHz and the burst are kept";
  EXPECT_NEAR(w.vehicle_at(0, t0 + milliseconds(50)).position_m.x, 0.5, 1e-3) << "the kept poses are still interpolated";
}

TEST(World, PosesAtOneKilohertzAreAllKept) {
  World w = one_rov();
  for (int i = 0; i < 1000; ++i) w.accept(stamped(i, ClockDomain::sim, milliseconds(i)), json, t0 + milliseconds(i));
  for (int i = 1000; i < 1060; ++i)  // held back for 60 ms
    w.accept(stamped(i, ClockDomain::sim, milliseconds(i)), json, t0 + milliseconds(1060));
  EXPECT_EQ(w.counters().over_rate, 0u);
}

TEST(World, OneBodysRateIsNotAnothers) {
  PoseRules rules;
  rules.burst = 1;
  World two(rules, {{"a", {}, false}, {"b", {}, false}}, {}, t0);
  for (int i = 0; i < 3; ++i) {
    for (const char* name : {"a", "b"}) {
      PoseSample s = at_x(i);
      s.name = name;
      two.accept(s, udp, t0 + milliseconds(i));
    }
  }
  EXPECT_EQ(two.counters().over_rate, 0u);
}

TEST(World, SteppedTimeHasNoRate) {
  PoseRules rules;
  rules.stepped = true;
  rules.burst = 1;
  World w = one_rov(rules);
  for (int i = 0; i < 100; ++i) w.accept(stamped(i, ClockDomain::sim, milliseconds(i)), json, Time{});
  EXPECT_EQ(w.counters().over_rate, 0u);
}

TEST(World, PosesGoStaleOnceAndComeBack) {
  World w = one_rov();
  w.accept(at_x(4, 1), udp, t0);
  EXPECT_TRUE(w.newly_stale(t0 + milliseconds(1000)).empty());
  EXPECT_FALSE(w.is_stale(0, t0 + milliseconds(1000)));
  EXPECT_TRUE(w.is_stale(0, t0 + milliseconds(1001)));
  const auto stale = w.newly_stale(t0 + milliseconds(1500));
  ASSERT_EQ(stale.size(), 1u);
  EXPECT_EQ(stale[0].vehicle, "rov");
  EXPECT_THAT(stale[0].sentence, HasSubstr("no pose for rov"));
  EXPECT_TRUE(w.newly_stale(t0 + milliseconds(1600)).empty()) << "each vehicle is reported once";
  EXPECT_EQ(w.vehicle_at(0, t0 + seconds(60)).position_m.x, 4) << "held";
  EXPECT_THAT(w.accept(at_x(4, 2), udp, t0 + seconds(2)).notice, HasSubstr("are back"));
  EXPECT_EQ(w.counters().stale, 1u);
}

TEST(World, NamesAreOptionalOnlyWhenThereIsNoChoice) {
  World two(PoseRules{}, {{"a", {}, false}, {"b", {}, false}}, {{"crate", {}, false}}, t0);
  PoseSample s = at_x(1);
  EXPECT_THAT(two.accept(s, udp, t0).refusal, HasSubstr("known: a, b"));
  s.name = "c";
  EXPECT_EQ(two.accept(s, udp, t0).verdict, PoseVerdict::unknown_name);
  EXPECT_EQ(two.counters().refused, 2u);
  s.name = "b";
  EXPECT_EQ(two.accept(s, udp, t0).verdict, PoseVerdict::accepted);
  EXPECT_EQ(two.vehicle_at(1, t0).position_m.x, 1);
  s.of = PoseSample::Of::object;
  EXPECT_EQ(two.accept(s, udp, t0).verdict, PoseVerdict::unknown_name);
}

TEST(World, ObjectsMoveAndHide) {
  World w(PoseRules{}, {{"rov", {}, false}}, {{"crate", {{1, 2, -5}, {}}, false}, {"diver", {{3, 4, -5}, {}}, false}}, t0);
  EXPECT_EQ(w.objects_at(t0)[0].position_m.y, 2);
  PoseSample s = at_x(9);
  s.of = PoseSample::Of::object;
  s.name = "crate";
  w.accept(s, udp, t0);
  EXPECT_EQ(w.objects_at(t0)[0].position_m.x, 9);
  EXPECT_EQ(w.objects_at(t0)[1].position_m.x, 3);
  s.hidden = true;
  w.accept(s, udp, t0 + milliseconds(1));
  EXPECT_GT(w.objects_at(t0)[0].position_m.z, 1000) << "far out of every sonar's range";
}

TEST(World, AnOrbitMovesAsItsPosesDo) {
  const World w = World({}, {{"rov", {{-7, 1, -3}, {}}, true}}, {}, t0);
  const Pose mount{{0.3, 0.1, -0.1}, quat_from_rpy({0, 0.26, 0.1})};
  for (const int s : {0, 7, 40}) {
    const Time t = t0 + seconds(s), later = t + milliseconds(10);
    const Twist moves = mounted_moves(w.vehicle_moves(0, t), w.vehicle_at(0, t), mount);
    const Pose from = compose(w.vehicle_at(0, t), mount), to = compose(w.vehicle_at(0, later), mount);
    EXPECT_NEAR(length(to.position_m - from.position_m - 0.01 * moves.velocity_mps), 0, 1e-5) << s;
    const Vec3d turned = rotation_between(from.orientation, to.orientation);
    EXPECT_NEAR(length(turned - 0.01 * moves.angular_rate_radps), 0, 1e-7) << s;
  }
  const Twist centre = mounted_moves(w.vehicle_moves(0, t0), w.vehicle_at(0, t0), {});
  EXPECT_NEAR(length(centre.velocity_mps), 0.5, 1e-9);
}

TEST(World, AVehicleMovesByItsPosesAndNotByAJump) {
  World w = one_rov();
  EXPECT_EQ(length(w.vehicle_moves(0, t0).velocity_mps), 0) << "at its initial pose the vehicle is at rest";
  w.accept(stamped(0, ClockDomain::wall, t0.time_since_epoch(), 1), udp, t0);
  w.accept(stamped(0.2, ClockDomain::wall, (t0 + milliseconds(100)).time_since_epoch(), 2), udp, t0 + milliseconds(100));
  EXPECT_NEAR(w.vehicle_moves(0, t0 + milliseconds(110)).velocity_mps.x, 2, 1e-6);
  EXPECT_EQ(length(w.vehicle_moves(0, t0 + seconds(2)).velocity_mps), 0) << "held";
  w.accept(stamped(20, ClockDomain::wall, (t0 + milliseconds(200)).time_since_epoch(), 3), udp, t0 + milliseconds(200));
  EXPECT_EQ(length(w.vehicle_moves(0, t0 + milliseconds(210)).velocity_mps), 0) << "198 m/s is no movement";
}

TEST(World, VehiclesOfAnotherConfigurationKeepTheirPosesByName) {
  World w = one_rov();
  w.accept(at_x(7), json, t0);
  w.use_vehicles({{"buoy", {{1, 1, 0}, {}}, false}, {"rov", {{0, 0, -9}, {}}, true}}, t0);
  EXPECT_EQ(w.vehicle_at(0, t0).position_m.x, 1);
  EXPECT_EQ(w.source_of(0), "initial pose");
  EXPECT_EQ(w.vehicle_at(1, t0).position_m.x, 7) << "the vehicle keeps the pose that its sender gave";
  EXPECT_EQ(w.source_of(1), "json 127.0.0.1");
  PoseSample next = at_x(8);
  next.name = "rov";
  EXPECT_TRUE(w.accept(next, json, t0 + milliseconds(100)).notice.empty()) << "the same sender may continue";
}

TEST(World, AVehicleWithoutPosesFollowsTheConfiguration) {
  World w = one_rov();
  w.use_vehicles({{"rov", {{0, -8, -2}, {}}, true}}, t0);
  EXPECT_EQ(w.source_of(0), "demo orbit");
  EXPECT_NEAR(w.vehicle_at(0, t0).position_m.y, -8, 1e-9);
}

TEST(World, ObjectsOfAnotherSceneKeepTheirPosesAndStayHidden) {
  World w(PoseRules{}, {{"rov", {}, false}}, {{"crate", {{5, 0, 0}, {}}, false}, {"whale", {}, false}}, t0);
  PoseSample s = at_x(3);
  s.of = PoseSample::Of::object;
  s.name = "crate";
  w.accept(s, json, t0);
  w.hide(0, true);
  w.use_objects({{"seal", {{2, 0, 0}, {}}, false}, {"crate", {{9, 0, 0}, {}}, false}}, t0);
  EXPECT_EQ(w.objects_at(t0).size(), 2u);
  EXPECT_EQ(w.object_at(0, t0).position_m.x, 2);
  EXPECT_TRUE(w.is_hidden(1));
  EXPECT_GT(w.object_at(1, t0).position_m.z, 1000) << "a hidden object is far away";
  w.hide(1, false);
  EXPECT_EQ(w.object_at(1, t0).position_m.x, 3);
}

TEST(World, ObjectsHiddenByControlAreShownAgainButNotThoseHiddenByPoses) {
  World w(PoseRules{}, {{"rov", {}, false}}, {{"crate", {}, false}, {"whale", {}, false}, {"seal", {}, false}}, t0);
  PoseSample s = at_x(3);
  s.of = PoseSample::Of::object;
  s.hidden = true;
  for (const char* name : {"crate", "seal"}) {
    s.name = name;
    w.accept(s, json, t0);
  }
  w.hide(1, true);
  w.hide(2, false);
  w.hide(2, true);
  w.show_again();
  EXPECT_TRUE(w.is_hidden(0));
  EXPECT_FALSE(w.is_hidden(1));
  EXPECT_FALSE(w.is_hidden(2)) << "the last request was one of control";
}

}  // namespace
}  // namespace sonar::world_test
