// Poses by every protocol change the requests to the engine; invalid ones change nothing and are counted.
#include <gmock/gmock.h>

#include <atomic>
#include <limits>
#include <list>

#include "daemon/server/system/listen.hpp"
#include "protocol/control/answers.hpp"
#include "protocol/control/control.hpp"
#include "tests/daemon/server/loopback.hpp"

namespace sonar::testing_daemon {
namespace {

using control::PoseSample;
using oculus::PingRate;
using ::testing::HasSubstr;

struct Poses : ::testing::Test {
  static DaemonSetup with_object() {
    DaemonSetup s;
    s.moving_object = true;
    s.more = "control: {stream: '" + s.address + ":0', http: off}\n";
    return s;
  }
  Poses() : daemon(with_object()), client(daemon.address()) {
    client.fire(fire_at(PingRate::hz40));
    EXPECT_TRUE(client.next_ping());
    protobuf_port = daemon.app().poses().protobuf().port;
    stream_port = daemon.app().control().stream().port;
    json_port = daemon.app().poses().json().port;
  }
  /// Returns true if a later ping was requested at x.
  bool asked_from(double x) {
    return eventually([&] {
      client.next_ping(milliseconds(100));
      const auto all = daemon.requests();
      return !all.empty() && std::abs(all.back().vehicle_in_world.position_m.x - x) < 1e-9;
    });
  }
  static PoseSample at_x(double x) {
    PoseSample s;
    s.pose.position_m = {x, 0, -3};
    return s;
  }
  static std::string json_at_x(int x) { return "{\"position\":[0," + std::to_string(x) + ",3],\"attitude\":[0,0,0]}\n"; }
  Daemon daemon;
  Client client;
  std::uint16_t protobuf_port = 0, stream_port = 0, json_port = 0;
};

TEST(PoseSenders, OnlyThisComputerIsAcceptedByDefault) {
  const auto from = [](const char* text) { return asio::ip::make_address(text); };
  EXPECT_TRUE(is_admitted({}, from("127.0.0.1")) && is_admitted({}, from("127.9.8.7")));
  EXPECT_FALSE(is_admitted({}, from("192.168.2.2"))) << "the ranges of a listener for others may be gone after a reload";
  const std::vector<AddressRange> lab{{{192, 168, 2, 0}, 24}};
  EXPECT_TRUE(is_admitted(lab, from("192.168.2.2")));
  EXPECT_FALSE(is_admitted(lab, from("192.168.3.2")) || is_admitted(lab, from("127.0.0.1")) || is_admitted(lab, from("::1")));
}

TEST_F(Poses, AProtobufDatagramIsAccepted) {
  send_udp(daemon.address(), protobuf_port, control::encode_pose_datagram(at_x(11)));
  EXPECT_TRUE(asked_from(11));
  EXPECT_THAT(daemon.log_text(), HasSubstr("pose source of rov changed: initial pose -> protobuf 127."));
}

TEST_F(Poses, AJsonDatagramFromAShellIsAccepted) {
  send_udp(daemon.address(), json_port,
           bytes_of(R"({"timestamp":1.0,"position":[0,12,3],"attitude":[0,0.1,0.5],"velocity":[0,0,0]})"));
  EXPECT_TRUE(asked_from(12));
  EXPECT_THAT(daemon.log_text(), HasSubstr("fields: timestamp position attitude velocity (NED/FRD)"));
}

TEST_F(Poses, JsonLinesOverTcpAreAccepted) {
  Client sender(daemon.address(), json_port);
  sender.send(std::string("{\"position\":[0,13,3],\"att"));
  sender.send(std::string("itude\":[0,0,0]}\n"));
  EXPECT_TRUE(asked_from(13));
}

TEST_F(Poses, ControlStreamGreetsAndAnswers) {
  Client sender(daemon.address(), stream_port);
  sender.send(control::delimited(control::encode_request({1, control::Hello{}})));
  sender.send(control::delimited(control::encode_request({2, at_x(14)})));
  EXPECT_TRUE(asked_from(14));
  PoseSample crate = at_x(-6);
  crate.of = PoseSample::Of::object;
  crate.name = "crate";
  sender.send(control::delimited(control::encode_request({3, crate})));
  EXPECT_TRUE(eventually([&] {
    client.next_ping(milliseconds(100));
    const auto all = daemon.requests();
    return all.back().bodies_in_world.size() == 1 && all.back().bodies_in_world[0].position_m.x == -6;
  }));
  PoseSample unknown = at_x(1);
  unknown.name = "submarine";
  sender.send(control::delimited(control::encode_request({4, unknown})));

  control::DelimitedParser parser;
  std::vector<v1::Response> answers;
  while (answers.size() < 4) {
    const auto raw = sender.read_raw(1);
    ASSERT_FALSE(raw.empty());
    parser.feed(raw);
    for (auto m = parser.next(); m && *m; m = parser.next()) answers.push_back(**control::decode_response(**m));
  }
  EXPECT_TRUE(answers[0].has_hello());
  EXPECT_EQ(answers[1].status().code(), v1::Status::OK);
  EXPECT_EQ(answers[2].id(), 3u);
  EXPECT_EQ(answers[3].status().code(), v1::Status::REFUSED);
  EXPECT_THAT(answers[3].status().text(), HasSubstr("submarine"));
}

TEST_F(Poses, ControlStreamNeedsAHelloFirstAndTheRightVersion) {
  Client rude(daemon.address(), stream_port);
  rude.send(control::delimited(control::encode_request({7, at_x(99)})));
  EXPECT_GT(rude.read_raw(1).size(), 0u);
  EXPECT_TRUE(rude.read_to_end()) << "the client gets an answer, and the connection is closed";
  Client future(daemon.address(), stream_port);
  future.send(control::delimited(control::encode_request({8, control::Hello{2, ""}})));
  EXPECT_GT(future.read_raw(1).size(), 0u);
  EXPECT_TRUE(future.read_to_end());
  Client oversized(daemon.address(), stream_port);
  oversized.send(std::vector<std::byte>(8, std::byte{0xff}));
  EXPECT_TRUE(oversized.read_to_end());
}

TEST_F(Poses, ARepeatedRequestUsesTheSoundSpeedAtThePresentDepth) {
  const float at_3_m = daemon.requests().back().settings.device_sound_speed_mps;
  PoseSample deep = at_x(0);
  deep.pose.position_m.z = -45;  // within max_jump_m
  send_udp(daemon.address(), protobuf_port, control::encode_pose_datagram(deep));
  EXPECT_TRUE(eventually([&] {
    client.fire(fire_at(PingRate::hz40));
    client.next_ping(milliseconds(100));
    return daemon.requests().back().settings.device_sound_speed_mps > at_3_m + 0.3f;
  }));
  const std::string log = daemon.log_text();
  EXPECT_EQ(log.find("settings: "), log.rfind("settings: ")) << "a repeated request is not logged";
}

TEST_F(Poses, NonsenseIsRefusedCountedAndChangesNothing) {
  PoseSample broken = at_x(77);
  broken.pose.position_m.y = std::numeric_limits<double>::quiet_NaN();
  send_udp(daemon.address(), protobuf_port, control::encode_pose_datagram(broken));
  PoseSample unnormalised = at_x(78);
  unnormalised.pose.orientation = {2, 0, 0, 0};
  send_udp(daemon.address(), protobuf_port, control::encode_pose_datagram(unnormalised));
  send_udp(daemon.address(), protobuf_port, bytes_of("not protobuf at all"));
  send_udp(daemon.address(), protobuf_port, {});
  send_udp(daemon.address(), json_port, bytes_of("{\"position\":[0,79,NaN],\"attitude\":[0,0,0]}"));
  send_udp(daemon.address(), json_port, bytes_of(std::string(5000, '[')));
  send_udp(daemon.address(), json_port,
           bytes_of(R"({"position":[0,15,3],"attitude":[0,0,0]})"));  // the last pose, which marks the end
  EXPECT_TRUE(asked_from(15));
  for (const PingRequest& r : daemon.requests()) EXPECT_LT(r.vehicle_in_world.position_m.x, 70);
  EXPECT_THAT(daemon.log_text(), HasSubstr("pose refused: position has a NaN"));
  daemon.stop();
  EXPECT_EQ(daemon.app().world().counters().refused, 6u);
  EXPECT_EQ(daemon.app().world().counters().accepted, 1u);
}

TEST_F(Poses, ASilentConnectionIsEvictedForANewOne) {
  std::list<Client> senders;
  for (int i = 0; i < 32; ++i) {
    senders.emplace_back(daemon.address(), json_port);
    senders.back().send(json_at_x(20));
  }
  const auto heard = [&] {
    const v1::PoseFigures p = daemon.status().poses();
    return p.accepted() + p.refused() + p.late() + p.replaced() + p.over_rate();
  };
  ASSERT_TRUE(eventually([&] { return heard() == 32; }));
  ASSERT_TRUE(asked_from(20));
  std::this_thread::sleep_for(milliseconds(1200));
  for (Client& s : senders)
    if (&s != &senders.back()) s.send(json_at_x(21));  // all senders except the last
  ASSERT_TRUE(eventually([&] { return heard() == 32 + 31; }));
  ASSERT_TRUE(asked_from(21));
  Client late(daemon.address(), json_port);
  late.send(json_at_x(22));
  EXPECT_TRUE(asked_from(22));
  EXPECT_TRUE(senders.back().read_to_end());
  EXPECT_THAT(daemon.log_text(), HasSubstr("it was idle or over its limit for longest"));
  senders.front().send(json_at_x(23));
  EXPECT_TRUE(asked_from(23)) << "the other senders keep their connections";
}

/// Wall stamps are compared with the present clock, not with the clock at the daemon's start.
std::atomic<std::int64_t> clock_set_by_ns{0};
Time set_wall() { return Clock::system_wall() + std::chrono::nanoseconds(clock_set_by_ns.load()); }

TEST(PoseRules, WallStampsFollowAClockThatWasSetAfterTheStart) {
  clock_set_by_ns = 0;
  asio::io_context io;
  const Clock clock(false, set_wall);
  World world(PoseRules{}, {{"rov", {}, false}}, {}, clock.now());
  LogOptions options;
  std::string log_text;
  options.sink = [&](LogLevel, const std::string& line) { log_text += line + "\n"; };
  Log log(options);
  PoseConfig config;
  config.json.enabled = false;
  config.protobuf.at = {{127, 0, 0, 2}, 0};
  PoseIntake intake(world, clock, log, [&io] { io.stop(); });
  const LimitConfig limits;
  Admission admission(limits, log);
  PoseServer server(io, config, limits, admission, intake, log);
  ASSERT_TRUE(server.open());
  server.start();
  const auto accepted_at = [&](Time stamp) {
    const auto before = world.counters().accepted;
    PoseSample sample;
    sample.pose.position_m = {5, 0, -3};
    sample.stamp = {control::ClockDomain::wall, stamp.time_since_epoch().count()};
    const Endpoint to = server.protobuf();
    send_udp(text_of(to.ip), to.port, control::encode_pose_datagram(sample));
    io.restart();
    io.run_for(patience);
    return world.counters().accepted > before;
  };
  EXPECT_TRUE(accepted_at(set_wall())) << log_text;
  for (const int hours : {24, -48}) {
    clock_set_by_ns = std::chrono::nanoseconds(std::chrono::hours(hours)).count();
    EXPECT_TRUE(accepted_at(set_wall())) << log_text;
    EXPECT_NEAR(world.vehicle_at(0, clock.now()).position_m.x, 5, 1e-9);
  }
  clock_set_by_ns = 0;
  EXPECT_FALSE(accepted_at(set_wall() + std::chrono::hours(24))) << "the stamp is compared with the present clock";
  EXPECT_THAT(log_text, HasSubstr("synchronise the clocks"));
  server.stop();
}

TEST(PoseRules, MountIsAppliedAndStalePosesBlankThePicture) {
  DaemonSetup setup;
  setup.sonar_lines = "    mount: {frame: FRD, xyz_m: [0.3, 0, 0.1], rpy_deg: [0, -15, 0]}\n";
  setup.more = "poses: {protobuf: off, json: '" + setup.address + ":0', stale_after_s: 0.2, on_stale: blank}\n";
  Daemon daemon(setup);
  Client client(daemon.address());
  client.fire(fire_at(PingRate::hz40));
  ASSERT_TRUE(client.next_ping());
  const PingRequest first = daemon.requests().front();
  EXPECT_FALSE(first.blank) << "before its first pose, a vehicle is not stale";
  EXPECT_NEAR(first.sonar_in_world.position_m.x, 0.3, 1e-12);
  EXPECT_NEAR(first.sonar_in_world.position_m.z, -3.1, 1e-12);
  EXPECT_NEAR(rotate(first.sonar_in_world.orientation, {1, 0, 0}).z, -std::sin(rad_from_deg(15)), 1e-9) << "the sonar looks down";
  send_udp(daemon.address(), daemon.app().poses().json().port, bytes_of(R"({"position":[0,0,3],"attitude":[0,0,0]})"));
  EXPECT_TRUE(eventually([&] {
    client.next_ping(milliseconds(100));
    return daemon.requests().back().blank;
  }));
  EXPECT_TRUE(eventually([&] { return daemon.log_text().find("no pose for rov") != std::string::npos; }));
}

TEST(PoseRules, StopMeansNoPingsWithoutPoses) {
  DaemonSetup setup;
  setup.more = "poses: {protobuf: off, json: '" + setup.address + ":0', stale_after_s: 0.2, on_stale: stop}\n";
  Daemon daemon(setup);
  Client client(daemon.address());
  client.fire(fire_at(PingRate::hz40));
  ASSERT_TRUE(client.next_ping());
  const auto port = daemon.app().poses().json().port;
  send_udp(daemon.address(), port, bytes_of(R"({"position":[0,0,3],"attitude":[0,0,0]})"));
  EXPECT_TRUE(eventually([&] { return !client.next_ping(milliseconds(400)); }));
  EXPECT_TRUE(eventually([&] {  // on a busy computer a pose may be stale before the next ping is due
    send_udp(daemon.address(), port, bytes_of(R"({"position":[0,0,3],"attitude":[0,0,0]})"));
    return client.next_ping(milliseconds(100)).has_value();
  }));
}

TEST(PoseRules, OnlyAllowedAddressesAreAccepted) {
  DaemonSetup setup;
  setup.more = "poses: {protobuf: off, json: '" + setup.address + ":0', allow_from: [10.0.0.0/8]}\n";
  Daemon daemon(setup);
  send_udp(daemon.address(), daemon.app().poses().json().port, bytes_of(R"({"position":[0,0,3],"attitude":[0,0,0]})"));
  EXPECT_TRUE(eventually([&] { return daemon.log_text().find("not in poses.allow_from") != std::string::npos; }));
  daemon.stop();
  EXPECT_EQ(daemon.app().world().counters().accepted, 0u);
}

}  // namespace
}  // namespace sonar::testing_daemon
