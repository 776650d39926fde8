// What is said to the autopilot and to the user.
#include "tests/protocol/mavlink/mavlink_testing.hpp"

namespace sonar::mavlink {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

std::vector<Frame> known_frames(const std::vector<Bytes>& datagrams) {
  std::vector<Frame> frames;
  for (const Bytes& d : datagrams) {
    FrameReader reader(d);
    while (auto f = reader.next()) frames.push_back(*f);
  }
  return frames;
}
/// Message and interval in microseconds of every request.
std::vector<std::pair<int, int>> requests(const std::vector<Bytes>& datagrams) {
  std::vector<std::pair<int, int>> all;
  for (const Bytes& d : datagrams) {
    if (std::to_integer<int>(d.at(7)) != static_cast<int>(CommandLong::id)) continue;
    Bytes payload(d.begin() + 10, d.end() - 2);
    payload.resize(33);
    CommandLong m;
    wire::Reader reader(payload);
    fields(reader, m);
    EXPECT_EQ(m.command, 511);
    all.emplace_back(static_cast<int>(m.param1), static_cast<int>(m.param2));
  }
  return all;
}
std::string report_of(Settings settings, const Bytes& datagram) {
  MavlinkPoses poses(std::move(settings));
  poses.on_datagram(datagram, at_s(10));
  EXPECT_THAT(poses.on_tick(at_s(10.9)).notices, IsEmpty()) << "it listens for a second first";
  const auto notices = poses.on_tick(at_s(11)).notices;
  EXPECT_THAT(poses.on_tick(at_s(12)).notices, IsEmpty()) << "said once";
  return notices.size() == 1 ? notices[0] : "";
}

TEST(MavlinkSpeaks, AHeartbeatASecondAsAnOnboardComputerOfTheSystem) {
  MavlinkPoses poses({});
  int beats = 0;
  for (int i = 0; i < 40; ++i) beats += static_cast<int>(poses.on_tick(at_s(100 + 0.25 * i)).replies.size());
  EXPECT_EQ(beats, 10);
  Sender v{{42, 1, 0}};
  poses.on_datagram(v(autopilot_heartbeat()), at_s(110));
  const auto frames = known_frames(poses.on_tick(at_s(111)).replies);
  ASSERT_EQ(frames.size(), 1u);
  EXPECT_EQ(frames[0].system, 42);
  EXPECT_EQ(frames[0].component, MavlinkPoses::own_component);
  const Heartbeat beat = message_in<Heartbeat>(frames[0]);
  EXPECT_EQ(beat.type, 18);
  EXPECT_EQ(beat.autopilot, 8);
  EXPECT_EQ(beat.mavlink_version, 3);
}

TEST(MavlinkSpeaks, RatesAreRequestedOnlyWhenWantedAndUntilPosesCome) {
  Sender v;
  MavlinkPoses quiet({});
  quiet.on_datagram(v(autopilot_heartbeat()), at_s(1));
  EXPECT_THAT(requests(quiet.on_tick(at_s(1.1)).replies), IsEmpty());

  Settings settings;
  settings.request_rates = true;
  settings.rate_hz = 20;
  MavlinkPoses asks(settings);
  EXPECT_THAT(requests(asks.on_tick(at_s(0)).replies), IsEmpty()) << "nobody is there yet";
  asks.on_datagram(v(autopilot_heartbeat()), at_s(1));
  using Pairs = std::vector<std::pair<int, int>>;
  const Pairs wanted{{331, 50000}, {31, 50000}, {32, 50000}};
  EXPECT_EQ(requests(asks.on_tick(at_s(1.1)).replies), wanted);
  EXPECT_THAT(requests(asks.on_tick(at_s(2)).replies), IsEmpty());
  EXPECT_EQ(requests(asks.on_tick(at_s(6.2)).replies), wanted) << "again: nothing came of it";
  asks.on_datagram(v(odometry(1, 0)), at_s(7));
  EXPECT_THAT(requests(asks.on_tick(at_s(11.5)).replies), IsEmpty());

  settings.origin = Geodetic{0.8, -2, 0};
  MavlinkPoses geodetic(settings);
  geodetic.on_datagram(v(autopilot_heartbeat()), at_s(1));
  EXPECT_EQ(requests(geodetic.on_tick(at_s(1)).replies),
            (Pairs{{331, 50000}, {31, 50000}, {32, 50000}, {108, 50000}, {33, 50000}, {49, 1000000}}));
}

TEST(MavlinkSpeaks, TheFirstSentenceNamesSystemMessagesAndSource) {
  Sender v;
  EXPECT_EQ(report_of({}, v(autopilot_heartbeat()) + v(attitude(1, 0)) + v(local(1, 0, 0, 0))),
            "system 1 (ArduPilot) sends HEARTBEAT, ATTITUDE, LOCAL_POSITION_NED; poses from LOCAL_POSITION_NED and attitude");
  EXPECT_EQ(report_of({}, Sender{{3, 1, 0}}(odometry(1, 0))), "system 3 sends ODOMETRY; poses from ODOMETRY");
}

TEST(MavlinkSpeaks, TheFirstSentenceSaysWhatIsMissing) {
  Sender v;
  const Bytes beat = v(autopilot_heartbeat());
  GlobalPositionInt global;
  global.latitude_e7_deg = 476000000, global.longitude_e7_deg = -1223300000;
  SimState sim;
  sim.latitude_deg = 47.6f, sim.longitude_deg = -122.33f;
  Settings origin;
  origin.origin = Geodetic{rad_from_deg(47.6), rad_from_deg(-122.33), 0};

  EXPECT_THAT(report_of({}, beat), HasSubstr("no poses yet: set its stream rates, or request_rates: true"));
  EXPECT_THAT(report_of({}, beat + v(attitude(1, 0)) + v(global)),
              HasSubstr("no poses yet: GLOBAL_POSITION_INT needs world.origin"));
  EXPECT_THAT(report_of({}, beat + v(sim)), HasSubstr("SIM_STATE needs world.origin"));
  EXPECT_THAT(report_of({}, v(local(1, 0, 0, 0))), HasSubstr("a position needs ATTITUDE or ATTITUDE_QUATERNION beside it"));
  EXPECT_THAT(report_of({}, v(attitude(1, 0))), HasSubstr("an attitude needs LOCAL_POSITION_NED beside it"));
  EXPECT_THAT(report_of(origin, v(attitude(1, 0)) + v(GlobalPositionInt{})), HasSubstr("GLOBAL_POSITION_INT has no fix"));
  EXPECT_THAT(report_of(origin, v.version_1(sim)), HasSubstr("poses from SIM_STATE, in steps of up to 0.4 m"));
  Odometry broken = odometry(1, 0);
  broken.frame_id = 99;
  EXPECT_THAT(report_of({}, v(broken)), AllOf(HasSubstr("what came was refused"), Not(HasSubstr("request_rates"))));
}

TEST(MavlinkSpeaks, AnotherSystemIsReportedToo) {
  MavlinkPoses poses({});
  poses.on_datagram(Sender{{1, 1, 0}}(odometry(1, 0)), at_s(0));
  EXPECT_THAT(poses.on_tick(at_s(2)).notices, ElementsAre(HasSubstr("system 1 ")));
  poses.on_datagram(Sender{{2, 1, 0}}(odometry(1, 0)), at_s(10));
  EXPECT_THAT(poses.on_tick(at_s(12)).notices, ElementsAre(HasSubstr("system 2 ")));
}

}  // namespace
}  // namespace sonar::mavlink
