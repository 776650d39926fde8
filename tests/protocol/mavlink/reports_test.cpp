// Tests heartbeats and requests to the autopilot, and notices to the user.
#include <functional>

#include "tests/protocol/mavlink/mavlink_testing.hpp"

namespace sonar::mavlink {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::Pair;

std::vector<Frame> known_frames(const std::vector<Bytes>& datagrams) {
  std::vector<Frame> frames;
  for (const Bytes& d : datagrams) {
    FrameReader reader(d);
    while (auto f = reader.next()) frames.push_back(*f);
  }
  return frames;
}
/// Returns the message and the interval in microseconds of every request.
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
  EXPECT_THAT(poses.on_tick(at_s(10.9)).notices, IsEmpty()) << "the first report comes after a second";
  const auto notices = poses.on_tick(at_s(11)).notices;
  EXPECT_THAT(poses.on_tick(at_s(12)).notices, IsEmpty()) << "the report is not repeated";
  return notices.size() == 1 ? notices[0] : "";
}

TEST(MavlinkReports, SendsOneHeartbeatPerSecondAsOnboardComputer) {
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

TEST(MavlinkReports, RatesAreRequestedIfConfiguredUntilPosesCome) {
  Sender v;
  MavlinkPoses quiet({});
  quiet.on_datagram(v(autopilot_heartbeat()), at_s(1));
  EXPECT_THAT(requests(quiet.on_tick(at_s(1.1)).replies), IsEmpty());

  Settings settings;
  settings.request_rates = true;
  settings.rate_hz = 20;
  MavlinkPoses asks(settings);
  EXPECT_THAT(requests(asks.on_tick(at_s(0)).replies), IsEmpty()) << "no rates are requested before the first message";
  asks.on_datagram(v(autopilot_heartbeat()), at_s(1));
  using Pairs = std::vector<std::pair<int, int>>;
  const Pairs wanted{{331, 50000}, {31, 50000}, {32, 50000}, {33, 50000}};
  EXPECT_EQ(requests(asks.on_tick(at_s(1.1)).replies), wanted);
  EXPECT_THAT(requests(asks.on_tick(at_s(2)).replies), IsEmpty());
  EXPECT_EQ(requests(asks.on_tick(at_s(6.2)).replies), wanted) << "rates are requested again, because none of the messages came";
  asks.on_datagram(v(odometry(1, 0)), at_s(7));
  EXPECT_THAT(requests(asks.on_tick(at_s(11.5)).replies), IsEmpty());

  settings.origin = Geodetic{0.8, -2, 0};
  MavlinkPoses geodetic(settings);
  geodetic.on_datagram(v(autopilot_heartbeat()), at_s(1));
  EXPECT_EQ(requests(geodetic.on_tick(at_s(1)).replies),
            (Pairs{{331, 50000}, {31, 50000}, {32, 50000}, {33, 50000}, {108, 50000}, {49, 1000000}}));
}

TEST(MavlinkReports, TheFirstLineNamesSystemMessagesAndSource) {
  Sender v;
  EXPECT_EQ(report_of({}, v(autopilot_heartbeat()) + v(attitude(1, 0)) + v(local(1, 0, 0, 0))),
            "system 1 (ArduPilot) sends HEARTBEAT, ATTITUDE, LOCAL_POSITION_NED; poses from LOCAL_POSITION_NED and attitude");
  EXPECT_EQ(report_of({}, Sender{{3, 1, 0}}(odometry(1, 0))), "system 3 sends ODOMETRY; poses from ODOMETRY");
}

TEST(MavlinkReports, TheFirstLineNamesMissingMessages) {
  Sender v;
  const Bytes beat = v(autopilot_heartbeat());
  GlobalPositionInt global;
  global.latitude_e7_deg = 476000000, global.longitude_e7_deg = -1223300000;
  SimState sim;
  sim.latitude_deg = 47.6f, sim.longitude_deg = -122.33f;
  Settings origin;
  origin.origin = Geodetic{rad_from_deg(47.6), rad_from_deg(-122.33), 0};

  EXPECT_THAT(report_of({}, beat),
              EndsWith("no poses yet: an attitude is missing (ATTITUDE_QUATERNION or ATTITUDE); a position or depth is "
                       "missing (LOCAL_POSITION_NED; GLOBAL_POSITION_INT with world.origin or depth alone; of a submarine also "
                       "VFR_HUD); set its stream rates (ArduPilot: SR0_POSITION, SR0_EXTRA1), or request_rates: true"));
  EXPECT_THAT(report_of({}, beat + v(attitude(1, 0)) + v(global)),
              HasSubstr("no poses yet: GLOBAL_POSITION_INT needs world.origin"));
  EXPECT_THAT(report_of({}, beat + v(sim)), HasSubstr("SIM_STATE needs world.origin"));
  EXPECT_THAT(report_of({}, v(local(1, 0, 0, 0))),
              AllOf(HasSubstr("no poses yet: an attitude is missing"), Not(HasSubstr("a position or depth is missing"))));
  EXPECT_THAT(report_of({}, v(attitude(1, 0))),
              AllOf(HasSubstr("no poses yet: a position or depth is missing"), HasSubstr("of a submarine also VFR_HUD"),
                    Not(HasSubstr("an attitude is missing")), Not(HasSubstr("VFR_HUD gives"))));
  Heartbeat boat = autopilot_heartbeat();
  boat.type = 11;  // MAV_TYPE_SURFACE_BOAT
  EXPECT_THAT(report_of({}, v(boat) + v(attitude(1, 0)) + v(VfrHud{})),
              HasSubstr("VFR_HUD gives a depth only if HEARTBEAT says that the vehicle is a submarine"));
  EXPECT_THAT(report_of({}, v(global)), AllOf(HasSubstr("GLOBAL_POSITION_INT needs world.origin; an attitude is missing")));
  EXPECT_THAT(report_of(origin, v(global)), AllOf(HasSubstr("an attitude is missing"), Not(HasSubstr("no fix"))));
  Settings asks;
  asks.request_rates = true;
  EXPECT_THAT(report_of(asks, beat), EndsWith("requested (request_rates) but not received"));
  EXPECT_THAT(report_of(origin, v(attitude(1, 0)) + v(GlobalPositionInt{})), HasSubstr("GLOBAL_POSITION_INT has no fix"));
  Settings held;
  held.held_m = {5, -2.5, 0};
  EXPECT_THAT(
      report_of(held, beat + v(GlobalPositionInt{}) + v(attitude(1, 0))),
      EndsWith("poses from depth and attitude; x and y are held at 5, -2.5: GLOBAL_POSITION_INT has no fix, and there is no "
               "LOCAL_POSITION_NED: no DVL or the like"));
  EXPECT_THAT(report_of({}, beat + v(global) + v(attitude(1, 0))),
              EndsWith("x and y are held at 0, 0: GLOBAL_POSITION_INT needs world.origin"));
  EXPECT_THAT(report_of({}, beat + v(VfrHud{}) + v(attitude(1, 0))),
              EndsWith("x and y are held at 0, 0: GLOBAL_POSITION_INT and LOCAL_POSITION_NED are missing"));
  EXPECT_THAT(report_of(origin, v.version_1(sim)), HasSubstr("poses from SIM_STATE, in steps of up to 0.4 m"));
  Odometry broken = odometry(1, 0);
  broken.frame_id = 99;
  EXPECT_THAT(report_of({}, v(broken)), AllOf(HasSubstr("the received messages were refused"), Not(HasSubstr("request_rates"))));
}

/// Returns the notices between two times, each with its time in seconds.
std::vector<std::pair<int, std::string>> notices_of(MavlinkPoses& poses, int from_s, int to_s,
                                                    const std::function<void(int)>& each = {}) {
  std::vector<std::pair<int, std::string>> all;
  for (int s = from_s; s < to_s; ++s) {
    if (each) each(s);
    for (const std::string& notice : poses.on_tick(at_s(s)).notices) all.emplace_back(s, notice);
  }
  return all;
}

TEST(MavlinkReports, NothingIsMissingWhilePosesComeFromOtherSenders) {
  bool come = true;
  MavlinkPoses poses({}, {}, {}, [&come] { return come; });
  EXPECT_THAT(notices_of(poses, 0, 60, [](int) {}), IsEmpty());
  EXPECT_EQ(poses.health_error(at_s(60)), "");
  come = false;
  EXPECT_THAT(poses.health_error(at_s(60)), HasSubstr("no message received"));
}

TEST(MavlinkReports, MissingMessagesAreReportedLessAndLessOftenUntilTheyCome) {
  Sender v;
  MavlinkPoses poses({});
  const auto beats = [&](int s) { poses.on_datagram(v(autopilot_heartbeat()), at_s(s)); };
  const auto missing = notices_of(poses, 0, 121, beats);
  std::vector<int> when;
  for (const auto& [s, text] : missing) {
    when.push_back(s);
    EXPECT_THAT(text, HasSubstr("an attitude is missing"));
  }
  EXPECT_THAT(when, ElementsAre(1, 16, 46, 106));
  EXPECT_THAT(poses.health_error(at_s(120)), HasSubstr("an attitude is missing"));

  const auto tilts = [&](int s) { poses.on_datagram(v(attitude(static_cast<std::uint32_t>(1000 * s), 0)), at_s(s)); };
  EXPECT_THAT(
      notices_of(poses, 121, 230, tilts),
      ElementsAre(Pair(226, AllOf(HasSubstr("a position or depth is missing"), Not(HasSubstr("an attitude is missing"))))))
      << "the attitude, which has come, is not reported as missing";
  const auto poses_come = [&](int s) { poses.on_datagram(v(odometry(1'000'000ull * static_cast<unsigned>(s), 1)), at_s(s)); };
  EXPECT_THAT(notices_of(poses, 230, 900, poses_come), ElementsAre(Pair(230, HasSubstr("poses from ODOMETRY"))));
  EXPECT_THAT(poses.health_error(at_s(900)), IsEmpty());
  const auto silent = notices_of(poses, 900, 921);
  ASSERT_EQ(silent.size(), 2u);
  EXPECT_EQ(silent[0].first, 905);
  EXPECT_THAT(silent[0].second, HasSubstr("system 1 (ArduPilot) has sent nothing for 6 s: no poses"));
}

TEST(MavlinkReports, PosesThatEndWhileTheSystemSendsAreReported) {
  Sender v;
  MavlinkPoses poses({});
  poses.on_datagram(v(odometry(1, 0)), at_s(0));
  const auto sentences = notices_of(poses, 1, 10, [&](int s) { poses.on_datagram(v(autopilot_heartbeat()), at_s(s)); });
  EXPECT_THAT(sentences, ElementsAre(Pair(1, HasSubstr("poses from ODOMETRY")),
                                     Pair(6, AllOf(HasSubstr("sends HEARTBEAT; no more poses: an attitude is missing"),
                                                   Not(HasSubstr("sends HEARTBEAT, ODOMETRY"))))));
}

TEST(MavlinkReports, ALinkWithoutMessagesOfTheConfiguredVehicleIsReported) {
  MavlinkPoses silent({});
  EXPECT_THAT(notices_of(silent, 0, 10), ElementsAre(Pair(5, HasSubstr("no poses yet: no message received"))));
  EXPECT_THAT(silent.health_error(at_s(1)), HasSubstr("no message received"));

  Settings settings;
  settings.system_id = 2;
  MavlinkPoses filtered(settings);
  const auto speaks = [&](int s) { filtered.on_datagram(Sender{{1, 1, 0}}(odometry(1, 0)), at_s(s)); };
  EXPECT_THAT(
      notices_of(filtered, 0, 10, speaks),
      ElementsAre(Pair(5, "no poses yet: system 1, component 1 sends messages, but does not match system_id and component_id")));

  MavlinkPoses station({});
  Heartbeat beat = autopilot_heartbeat();
  beat.autopilot = Heartbeat::no_autopilot;
  const auto beats = [&](int s) { station.on_datagram(Sender{{255, 190, 0}}(beat), at_s(s)); };
  EXPECT_THAT(notices_of(station, 0, 10, beats),
              ElementsAre(Pair(5, HasSubstr("system 255, component 190 sends messages, but neither"))));
}

TEST(MavlinkReports, IgnoredSendersAreNamedOnce) {
  Settings settings;
  settings.vehicle = "rov";
  MavlinkPoses poses(settings);
  Sender one{{7, 1, 0}}, two{{8, 1, 0}}, companion{{7, 191, 0}}, station{{255, 190, 0}};
  Heartbeat of_station;
  of_station.type = 6, of_station.autopilot = 8;
  EXPECT_THAT(poses.on_datagram(one(odometry(1, 0)), at_s(0)).notices, IsEmpty());
  EXPECT_THAT(poses.on_datagram(station(of_station), at_s(0.1)).notices, IsEmpty()) << "ground stations are allowed";
  EXPECT_THAT(poses.on_datagram(two(autopilot_heartbeat()), at_s(0.2)).notices,
              ElementsAre(AllOf(HasSubstr("system 8, component 1 sends HEARTBEAT and is ignored"),
                                HasSubstr("system 7, component 1 steers rov; give each vehicle a port of its own"))));
  EXPECT_THAT(poses.on_datagram(two(odometry(1, 0)), at_s(0.3)).notices, IsEmpty()) << "each sender is reported once";
  EXPECT_THAT(poses.rival(at_s(5.2)), HasSubstr("system 8, component 1 sends HEARTBEAT and is ignored"))
      << "system 8 is a rival while it sends";
  EXPECT_THAT(poses.rival(at_s(5.4)), IsEmpty());
  EXPECT_THAT(poses.on_datagram(companion(odometry(1, 0)), at_s(0.4)).notices,
              ElementsAre(AllOf(HasSubstr("system 7, component 191 sends ODOMETRY and is ignored"),
                                HasSubstr("system 7, component 1 steers rov; component_id selects another"))));
  EXPECT_THAT(poses.rival(at_s(5.35)), IsEmpty()) << "a companion of the vehicle is no rival";
  for (int system = 9; system < 250; ++system) {
    Sender more{{static_cast<std::uint8_t>(system), 1, 0}};
    const auto notices = poses.on_datagram(more(odometry(1, 0)), at_s(0.5)).notices;
    EXPECT_EQ(notices.empty(), system >= 23) << system;
  }
  Sender late{{240, 1, 0}};
  for (int s = 4; s <= 60; s += 4)
    for (Sender* const speaks : {&one, &two})
      poses.on_datagram((*speaks)(odometry(1'000'000ull * static_cast<unsigned>(s), 0)), at_s(s));
  EXPECT_THAT(poses.on_datagram(late(odometry(1, 0)), at_s(61)).notices, ElementsAre(HasSubstr("system 240, component 1 sends")))
      << "a sender that has been silent for a minute leaves its place";
  EXPECT_THAT(poses.on_datagram(two(odometry(61'000'000, 0)), at_s(62)).notices, IsEmpty()) << "system 8 was not silent";
  EXPECT_THAT(poses.rival(at_s(62)), HasSubstr("system 8"));
}

TEST(MavlinkReports, ExcludedSendersAreNotNamed) {
  Sender one{{7, 1, 0}}, companion{{7, 191, 0}}, two{{8, 1, 0}}, its_companion{{8, 191, 0}};
  const auto notices = [&](std::uint8_t system, std::uint8_t component, const Bytes& other) {
    Settings settings;
    settings.system_id = system;
    settings.component_id = component;
    MavlinkPoses poses(settings);
    EXPECT_TRUE(poses.on_datagram(one(odometry(1, 0)), at_s(0)).from_vehicle);
    return poses.on_datagram(other, at_s(0.1)).notices;
  };
  EXPECT_THAT(notices(7, 0, two(odometry(1, 0))), IsEmpty());
  EXPECT_THAT(notices(7, 0, companion(odometry(1, 0))), ElementsAre(HasSubstr("component_id selects another")));
  EXPECT_THAT(notices(0, 1, companion(odometry(1, 0))), IsEmpty());
  EXPECT_THAT(notices(0, 1, its_companion(odometry(1, 0))), IsEmpty());
  EXPECT_THAT(notices(0, 1, two(odometry(1, 0))), ElementsAre(HasSubstr("select one by system_id")));
  EXPECT_THAT(notices(7, 1, its_companion(odometry(1, 0))), IsEmpty());
}

TEST(MavlinkReports, AnotherSystemIsReportedToo) {
  MavlinkPoses poses({});
  poses.on_datagram(Sender{{1, 1, 0}}(odometry(1, 0)), at_s(0));
  EXPECT_THAT(poses.on_tick(at_s(2)).notices, ElementsAre(HasSubstr("system 1 ")));
  poses.on_datagram(Sender{{2, 1, 0}}(odometry(1, 0)), at_s(10));
  EXPECT_THAT(poses.on_tick(at_s(12)).notices, ElementsAre(HasSubstr("system 2 ")));
}

}  // namespace
}  // namespace sonar::mavlink
