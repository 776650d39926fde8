// Tests the accepted senders and messages, the poses made from them, and the stamps of these poses.
#include <limits>
#include <utility>

#include "tests/protocol/mavlink/mavlink_testing.hpp"

namespace sonar::mavlink {
namespace {

using control::ClockDomain;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

const Geodetic seattle{rad_from_deg(47.6), rad_from_deg(-122.33), 0};

Settings with_origin() {
  Settings s;
  s.origin = seattle;
  return s;
}
GlobalPositionInt global(std::uint32_t boot_ms, double latitude_deg, double longitude_deg, double altitude_m) {
  GlobalPositionInt m;
  m.boot_ms = boot_ms;
  m.latitude_e7_deg = static_cast<std::int32_t>(std::lround(latitude_deg * 1e7));
  m.longitude_e7_deg = static_cast<std::int32_t>(std::lround(longitude_deg * 1e7));
  m.altitude_mm = static_cast<std::int32_t>(std::lround(1000 * altitude_m));
  return m;
}

struct Link {
  explicit Link(Settings settings = {}) : poses(std::move(settings)) {}
  Reaction operator()(const Bytes& datagram, double now_s) { return poses.on_datagram(datagram, at_s(now_s)); }
  MavlinkPoses poses;
};

TEST(MavlinkPoses, OdometryIsAWholePose) {
  Sender v;
  Link link;
  const Reaction r = link(v(odometry(5'000'000, 7)), 1);
  ASSERT_EQ(r.poses.size(), 1u);
  const control::PoseSample& s = r.poses[0].sample;
  EXPECT_EQ(r.poses[0].source, "system 1 ODOMETRY");
  expect_near(s.pose.position_m, {0, 7, 0}, 1e-9);
  EXPECT_EQ(s.stamp.domain, ClockDomain::sim);
  EXPECT_EQ(s.stamp.ns, 5'000'000'000);
  EXPECT_EQ(s.sent_in, control::Frame::ned_frd);
  EXPECT_EQ(s.fields, "position attitude velocity rates");
  EXPECT_THAT(r.refusals, IsEmpty());
}

TEST(MavlinkPoses, AttitudeAndLocalPositionArePairedByBootTime) {
  Sender v;
  Link link;
  EXPECT_THAT(link(v(attitude(1000, 0)), 1.0).poses, IsEmpty());
  EXPECT_THAT(link(v(local(1050, 1, 0, 2)), 1.05).poses, IsEmpty()) << "the position waits for the next attitude";
  const Reaction r = link(v(attitude(1100, static_cast<float>(pi / 2))), 1.1);
  ASSERT_EQ(r.poses.size(), 1u);
  EXPECT_EQ(r.poses[0].sample.stamp.ns, 1'050'000'000);
  EXPECT_NEAR(heading_rad(r.poses[0].sample.pose.orientation), pi / 4, 1e-6);
  expect_near(r.poses[0].sample.pose.position_m, {0, 1, -2}, 1e-9);
}

GlobalPositionInt depth(std::uint32_t boot_ms, double depth_m, double down_mps = 0) {
  GlobalPositionInt m;
  m.boot_ms = boot_ms;
  m.altitude_mm = m.height_mm = static_cast<std::int32_t>(std::lround(-1000 * depth_m));
  m.down_cmps = static_cast<std::int16_t>(std::lround(100 * down_mps));
  return m;
}

TEST(MavlinkPoses, DepthAndAttitudeAreEnough) {
  Sender v;
  Settings settings;
  settings.held_m = {3, 4, 0};
  Link link(settings);
  EXPECT_THAT(link(v(autopilot_heartbeat()) + v(attitude(1000, 1)) + v(depth(1000, 3, 0.5)), 1).poses, IsEmpty());
  // Each attitude gives a pose. Between two depths the vehicle continues to sink, for at most one second.
  for (const auto& [ms, z_m] : {std::pair{1100u, -3.05}, {1200u, -3.1}, {5900u, -3.5}}) {
    const Reaction r = link(v(attitude(ms, static_cast<float>(pi / 2))), 1e-3 * ms);
    ASSERT_EQ(r.poses.size(), 1u) << ms;
    const control::PoseSample& s = r.poses[0].sample;
    EXPECT_EQ(r.poses[0].source, "system 1 depth and attitude");
    expect_near(s.pose.position_m, {3, 4, z_m}, 1e-3);
    EXPECT_NEAR(heading_rad(s.pose.orientation), pi / 2, 1e-6);
    EXPECT_EQ(s.stamp.ns, 1'000'000ll * ms);
    EXPECT_EQ(s.fields, "position attitude rates") << "the velocity is not known";
  }
  EXPECT_THAT(link(v(attitude(6100, 0)), 6.1).poses, IsEmpty()) << "the depth is too old";
  // A position is preferred, and the depth is dropped after a fix.
  EXPECT_EQ(link(v(depth(6200, 2)) + v(local(6200, 1, 2, 5)) + v(attitude(6200, 0)), 6.2).poses.at(0).source,
            "system 1 LOCAL_POSITION_NED and attitude");
}

TEST(MavlinkPoses, VfrHudGivesTheDepthOfASubmarine) {
  VfrHud hud;
  hud.altitude_m = -7;
  for (const bool submarine : {true, false}) {
    Sender v;
    Link link;
    Heartbeat beat = autopilot_heartbeat();
    if (!submarine) beat.type = 2;
    const Reaction r = link(v(beat) + v(hud) + v(attitude(1000, 0)), 1);
    ASSERT_EQ(r.poses.size(), submarine ? 1u : 0u);
    for (const SourcedPose& pose : r.poses) EXPECT_NEAR(pose.sample.pose.position_m.z, -7, 1e-6);
  }
  Sender v;
  Link both;
  both(v(autopilot_heartbeat()) + v(depth(900, 2)) + v(hud), 1);
  EXPECT_NEAR(both(v(attitude(1000, 0)), 1.1).poses.at(0).sample.pose.position_m.z, -2, 1e-6) << "GLOBAL_POSITION_INT is better";
  hud.altitude_m = std::numeric_limits<float>::quiet_NaN();
  Link broken;
  EXPECT_THAT(broken(v(autopilot_heartbeat()) + v(hud) + v(attitude(1000, 0)), 1).poses, IsEmpty());
}

TEST(MavlinkPoses, HeartbeatsOfOtherComponentsDoNotChangeTheTypeOfTheVehicle) {
  VfrHud hud;
  hud.altitude_m = -7;
  GlobalPositionInt m = global(1000, 47.6, -122.33, 12);
  m.height_mm = -4000;
  Heartbeat other = autopilot_heartbeat();
  other.type = 26;      // a gimbal
  other.autopilot = 4;  // a value other than the autopilot's
  for (const std::uint8_t component : {std::uint8_t{100}, std::uint8_t{154}}) {
    Sender autopilot{{1, 1, 0}}, second{{1, component, 0}};
    for (const Bytes& order :
         {autopilot(autopilot_heartbeat()) + second(other), second(other) + autopilot(autopilot_heartbeat())}) {
      Link by_hud, by_place;
      EXPECT_EQ(by_hud(order + autopilot(hud) + autopilot(attitude(1000, 0)), 1).poses.size(), 1u) << int{component};
      EXPECT_EQ(by_place(order + autopilot(m) + autopilot(attitude(1000, 0)), 1).poses.size(), 1u) << int{component};
    }
    // If another component has the type of a submarine, the boat still counts as a boat.
    Heartbeat boat = autopilot_heartbeat();
    boat.type = 11;
    Link of_boat;
    EXPECT_THAT(of_boat(autopilot(boat) + second(autopilot_heartbeat()) + autopilot(hud) + autopilot(attitude(1000, 0)), 1).poses,
                IsEmpty());
    // If there is no component 1, the first autopilot is used.
    Sender sole{{1, 2, 0}};
    Link of_sole;
    EXPECT_EQ(of_sole(sole(autopilot_heartbeat()) + second(other) + sole(hud) + sole(attitude(1000, 0)), 1).poses.size(), 1u);
  }
}

TEST(MavlinkPoses, WithoutAnOriginAGlobalPositionGivesADepthOnlyForASubmarine) {
  for (const bool submarine : {true, false}) {
    Sender v;
    Link link;
    Heartbeat beat = autopilot_heartbeat();
    if (!submarine) beat.type = 11;  // a boat
    GlobalPositionInt m = global(1000, 47.6, -122.33, 12);
    m.height_mm = -4000;
    EXPECT_EQ(link(v(beat) + v(m) + v(attitude(1000, 0)), 1).poses.size(), submarine ? 1u : 0u);
  }
  Sender v;
  Link placed(with_origin());
  EXPECT_EQ(placed(v(autopilot_heartbeat()) + v(global(1000, 47.6, -122.33, -4)) + v(attitude(1000, 0)), 1).poses.at(0).source,
            "system 1 GLOBAL_POSITION_INT and attitude");
}

TEST(MavlinkPoses, TheQuaternionHasPriorityOverTheAngles) {
  Sender v;
  Link link;
  AttitudeQuaternion q;
  q.boot_ms = 1000;
  q.w = static_cast<float>(std::cos(0.15)), q.z = static_cast<float>(std::sin(0.15));
  const Reaction r = link(v(q) + v(attitude(1000, 2)) + v(local(1000, 0, 0, 0)), 1);
  ASSERT_EQ(r.poses.size(), 1u);
  EXPECT_NEAR(heading_rad(r.poses[0].sample.pose.orientation), 0.3, 1e-6);
  const Reaction later = link(v(attitude(3000, 2)) + v(local(3000, 0, 0, 0)), 3);
  ASSERT_EQ(later.poses.size(), 1u);
  EXPECT_NEAR(heading_rad(later.poses[0].sample.pose.orientation), 2, 1e-6);
}

TEST(MavlinkPoses, TheBestSourceThatStillSendsIsUsed) {
  Sender v;
  Link link;
  const auto pair = [&v](std::uint32_t ms) { return v(attitude(ms, 0)) + v(local(ms, 1, 1, 1)); };
  EXPECT_EQ(link(pair(1000), 1).poses.at(0).source, "system 1 LOCAL_POSITION_NED and attitude");
  AttPosMocap mocap;
  mocap.time_us = 1;
  EXPECT_EQ(link(v(mocap), 1.1).poses.at(0).source, "system 1 ATT_POS_MOCAP");
  EXPECT_EQ(link(v(odometry(1, 0)), 1.2).poses.at(0).source, "system 1 ODOMETRY");
  EXPECT_THAT(link(v(mocap) + pair(1300), 1.3).poses, IsEmpty());
  EXPECT_THAT(link(pair(2100), 2.15).poses, IsEmpty());
  EXPECT_EQ(link(pair(2300), 2.3).poses.at(0).source, "system 1 LOCAL_POSITION_NED and attitude")
      << "ODOMETRY is silent for 1.1 s";
}

TEST(MavlinkPoses, MessagesWithoutATimeAreNoSourceIfPosesSetTheTime) {
  Sender v;
  Settings settings = with_origin();
  settings.needs_time = true;
  Link link(settings);
  SimState sim;
  sim.latitude_e7_deg = 476000000, sim.longitude_e7_deg = -1223300000;
  sim.altitude_m = -12;
  Odometry timeless = odometry(0, 0);
  timeless.time_us = 0;
  const Reaction r = link(v(sim) + v(timeless) + v(attitude(1000, 0)) + v(local(1000, 1, 1, 1)), 1);
  ASSERT_EQ(r.poses.size(), 1u) << "messages without a time stamp do not delay the others";
  EXPECT_EQ(r.poses[0].source, "system 1 LOCAL_POSITION_NED and attitude");
  EXPECT_THAT(r.refusals, IsEmpty());
  ASSERT_EQ(r.notices.size(), 2u);
  EXPECT_THAT(r.notices[0], HasSubstr("SIM_STATE has no time stamp and is not used"));
  EXPECT_THAT(link(v(sim), 1.1).notices, IsEmpty()) << "a notice is given once";
}

TEST(MavlinkPoses, ASourceOfRefusedPosesIsNotUsed) {
  Sender v;
  Link link;
  Odometry broken = odometry(1, std::numeric_limits<float>::quiet_NaN());
  const Reaction r = link(v(broken) + v(attitude(5, 0)) + v(local(5, 1, 1, 1)), 1);
  ASSERT_EQ(r.poses.size(), 1u);
  ASSERT_EQ(r.refusals.size(), 1u);
  EXPECT_THAT(r.refusals[0], HasSubstr("ODOMETRY: position has a NaN"));
}

TEST(MavlinkPoses, GeodeticSourcesNeedAnOrigin) {
  Sender v;
  SimState sim;
  sim.latitude_e7_deg = 476000000, sim.longitude_e7_deg = -1223300000;
  sim.altitude_m = -12;
  Link without;
  EXPECT_THAT(without(v(sim) + v(attitude(1, 0)) + v(global(1, 47.6, -122.33, -12)), 1).poses, IsEmpty());
  Link with(with_origin());
  const Reaction r = with(v(sim) + v(attitude(1, 0)) + v(global(1, 47.6, -122.33, -12)), 1);
  ASSERT_EQ(r.poses.size(), 1u);
  EXPECT_EQ(r.poses[0].source, "system 1 SIM_STATE");
  EXPECT_EQ(r.poses[0].sample.stamp.domain, ClockDomain::arrival) << "the message has no time stamp";
  expect_near(r.poses[0].sample.pose.position_m, {0, 0, -12}, 1e-6);
}

TEST(MavlinkPoses, GlobalPositionsLieOnTheTangentPlane) {
  Sender v;
  Link link(with_origin());
  GlobalPositionInt m = global(20, 47.601, -122.331, -3.5);
  m.north_cmps = 150;
  const Reaction r = link(v(attitude(20, 0)) + v(m), 1);
  ASSERT_EQ(r.poses.size(), 1u);
  // Lengths of a degree at 47.6 N: from the first terms of their series.
  EXPECT_NEAR(r.poses[0].sample.pose.position_m.y, 111.178, 0.01);
  EXPECT_NEAR(r.poses[0].sample.pose.position_m.x, -75.2, 0.1);
  EXPECT_NEAR(r.poses[0].sample.pose.position_m.z, -3.5, 0.01);
  EXPECT_NEAR(r.poses[0].sample.velocity_mps->x, 1.5, 1e-6);
}

TEST(MavlinkPoses, ZeroZeroIsNoFixAndAFarPositionIsRefused) {
  Sender v;
  Link link(with_origin());
  EXPECT_THAT(link(v(attitude(1, 0)) + v(global(1, 0, 0, 0)), 1).poses, IsEmpty());
  Link far(with_origin());
  const Reaction r =
      far(v(autopilot_heartbeat()) + v(attitude(1, 0)) + v(global(2, -35.363, 149.165, 584)) + v(attitude(2, 0)), 1.1);
  EXPECT_THAT(r.poses, IsEmpty()) << "the position gives no depth either";
  ASSERT_EQ(r.refusals.size(), 1u);
  EXPECT_THAT(r.refusals[0], HasSubstr("km from world.origin"));
}

TEST(MavlinkPoses, AnOriginOfTheAutopilotMovesItsLocalAxes) {
  Sender v;
  Link link(with_origin());
  const auto pair = [&v](std::uint32_t ms) { return v(attitude(ms, 0)) + v(local(ms, 10, 0, 0)); };
  const control::PoseSample before = link(pair(100), 0.1).poses.at(0).sample;
  expect_near(before.pose.position_m, {0, 10, 0}, 1e-6);
  GpsGlobalOrigin origin;
  origin.latitude_e7_deg = 476010000, origin.longitude_e7_deg = -1223300000, origin.altitude_mm = 2000;
  const control::PoseSample after = link(v(origin) + pair(200), 0.2).poses.at(0).sample;
  EXPECT_NEAR(after.pose.position_m.y, 121.18, 0.02);
  EXPECT_NEAR(after.pose.position_m.z, 2, 0.01);
  EXPECT_NE(after.reset_counter, before.reset_counter);
  const control::PoseSample same = link(v(origin) + pair(300), 0.3).poses.at(0).sample;
  EXPECT_EQ(same.reset_counter, after.reset_counter);
}

TEST(MavlinkPoses, ResetCountersBeginNewHistories) {
  Sender v;
  Link link;
  Odometry m = odometry(1'000'000, 0);
  m.reset_counter = 200;
  const auto first = link(v(m), 1).poses.at(0).sample.reset_counter;
  EXPECT_EQ(link(v(m), 1.1).poses.at(0).sample.reset_counter, first);
  m.reset_counter = 201;
  EXPECT_NE(link(v(m), 1.2).poses.at(0).sample.reset_counter, first);
}

TEST(MavlinkPoses, ARebootIsAReset) {
  Sender v;
  Link link;
  const auto pair = [&v](std::uint32_t ms) { return v(attitude(ms, 0)) + v(local(ms, 0, 0, 0)); };
  const auto first = link(pair(600'000), 1).poses.at(0).sample;
  EXPECT_THAT(link(v(local(599'500, 0, 0, 0)), 1.05).poses, IsEmpty()) << "a late position: no attitude of its time is known";
  const auto again = link(pair(2'000), 3).poses.at(0).sample;
  EXPECT_NE(again.reset_counter, first.reset_counter);
  EXPECT_EQ(again.stamp.ns, 2'000'000'000);

  Link whole;
  const auto counter = whole(v(odometry(90'000'000, 0)), 1).poses.at(0).sample.reset_counter;
  EXPECT_EQ(whole(v(odometry(89'500'000, 0)), 1).poses.at(0).sample.reset_counter, counter)
      << "a late packet is no restart; World decides whether to use it";
  EXPECT_NE(whole(v(odometry(1'000'000, 0)), 2).poses.at(0).sample.reset_counter, counter);
}

TEST(MavlinkPoses, ForImpossibleStampsTheTimeOfArrivalIsUsed) {
  Sender v;
  Link link;
  EXPECT_EQ(link(v(odometry(0, 0)), 1).poses.at(0).sample.stamp.domain, ClockDomain::arrival);
  EXPECT_EQ(link(v(odometry(~0ull, 0)), 1).poses.at(0).sample.stamp.domain, ClockDomain::arrival);
  EXPECT_EQ(link(v(odometry(1'700'000'000'000'000, 0)), 1).poses.at(0).sample.stamp.ns, 1'700'000'000'000'000'000);
}

TEST(MavlinkPoses, TheFirstVehicleThatSendsIsUsed) {
  Sender station{{255, 190, 0}}, one{{7, 1, 0}}, other{{8, 1, 0}};
  Link link;
  Heartbeat of_station;
  of_station.type = 6, of_station.autopilot = 8;
  link(station(of_station), 0.5);
  EXPECT_FALSE(link.poses.system()) << "a ground station is no vehicle";
  link(one(autopilot_heartbeat()), 1);
  EXPECT_EQ(link.poses.system(), 7);
  EXPECT_THAT(link(other(odometry(1, 0)), 1.1).poses, IsEmpty());
  EXPECT_EQ(link(one(odometry(1, 0)), 1.2).poses.size(), 1u);
  EXPECT_EQ(link(other(odometry(1, 0)), 6.3).poses.size(), 1u) << "the first vehicle is silent for more than 5 s";
  EXPECT_EQ(link.poses.system(), 8);
}

TEST(MavlinkPoses, SystemAndComponentCanBeNamed) {
  Settings settings;
  settings.system_id = 8, settings.component_id = 197;
  settings.vehicle = "rov";
  Link link(settings);
  EXPECT_THAT(link(Sender{{7, 197, 0}}(odometry(1, 0)), 1).poses, IsEmpty());
  EXPECT_THAT(link(Sender{{8, 1, 0}}(odometry(1, 0)), 1).poses, IsEmpty());
  const Reaction r = link(Sender{{8, 197, 0}}(odometry(1, 0)), 1);
  ASSERT_EQ(r.poses.size(), 1u);
  EXPECT_EQ(r.poses[0].sample.name, "rov");
}

TEST(MavlinkPoses, OnlyOneOfTwoComponentsWithTheSameMessageCounts) {
  Sender autopilot{{1, 1, 0}}, companion{{1, 191, 0}};
  Link link;
  EXPECT_EQ(link(autopilot(odometry(1'000'000, 0)), 1).poses.size(), 1u);
  EXPECT_THAT(link(companion(odometry(77'000'000, 5)), 1.1).poses, IsEmpty());
  EXPECT_EQ(link(companion(odometry(78'000'000, 5)), 7).poses.size(), 1u);
}

TEST(MavlinkPoses, TheAutopilotTakesOverFromAComponentThatSendsFirst) {
  Sender autopilot{{1, 1, 0}}, gimbal{{1, 154, 0}};
  Link link;
  const auto beat = autopilot(autopilot_heartbeat());
  link(gimbal(attitude(900, 2)) + beat + gimbal(attitude(1000, 2)), 1);
  for (const std::uint32_t ms : {1100u, 1200u}) {
    const Reaction r = link(
        gimbal(attitude(ms, 2)) + autopilot(attitude(ms, 0.5f)) + autopilot(local(ms, 1, 0, 2)) + gimbal(attitude(ms + 1, 2)),
        1e-3 * ms);
    ASSERT_EQ(r.poses.size(), 1u) << ms;
    EXPECT_NEAR(heading_rad(r.poses[0].sample.pose.orientation), 0.5, 1e-6) << ms;
  }
  // Messages of a second autopilot are ignored.
  const Reaction r = link(
      Sender{{1, 3, 0}}(autopilot_heartbeat()) + Sender{{1, 3, 0}}(attitude(1300, 2)) + autopilot(local(1200, 1, 0, 2)), 1.3);
  ASSERT_EQ(r.poses.size(), 1u);
  EXPECT_NEAR(heading_rad(r.poses[0].sample.pose.orientation), 0.5, 1e-6);
}

TEST(MavlinkPoses, OurOwnMessagesAreIgnored) {
  Sender us{{1, MavlinkPoses::own_component, 0}};
  Link link;
  EXPECT_THAT(link(us(odometry(1, 0)), 1).poses, IsEmpty());
  EXPECT_FALSE(link.poses.system());
}

TEST(MavlinkPoses, JunkIsRefusedWithOneLinePerDatagram) {
  Link link;
  EXPECT_THAT(link(Bytes(100, std::byte{7}), 1).refusals, ::testing::ElementsAre(HasSubstr("100 bytes are not MAVLink")));
  EXPECT_THAT(link(Bytes(MavlinkPoses::largest_datagram + 1), 1).refusals, ::testing::ElementsAre(HasSubstr("longer than")));
  Sender v;
  Bytes bad = v(odometry(1, 0));
  bad[20] ^= std::byte{1};
  EXPECT_THAT(link(bad, 1).refusals, ::testing::ElementsAre(HasSubstr("checksum")));
  EXPECT_EQ(link.poses.counts().bad_checksum, 1u);
}

}  // namespace
}  // namespace sonar::mavlink
