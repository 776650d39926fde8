// Requests of control to a running daemon: status, settings, water, poses, events. A fake engine makes the pings and
// stores its requests.
#include <gmock/gmock.h>

#include "protocol/control/answers.hpp"
#include "tests/daemon/server/loopback.hpp"

namespace sonar::testing_daemon {
namespace {

using oculus::PingRate;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using Code = OperationResult::Code;

control::SetSonar set_range(double range_m) {
  control::SetSonar s;
  s.range_m = range_m;
  return s;
}
control::SetSonar set_transmit(bool on) {
  control::SetSonar s;
  s.transmit = on;
  return s;
}

/// Returns true if `fine` is true for one of the next hundred pings.
template <class Fine>
bool sees(Client& client, Fine&& fine) {
  for (int i = 0; i < 100; ++i) {
    const auto ping = client.next_ping();
    if (!ping) return false;
    if (fine(*ping)) return true;
  }
  return false;
}
bool sees_range(Client& client, double range_m) {
  return sees(client, [=](const oculus::DecodedPing& p) { return p.head.fixed.fire.range == range_m; });
}

TEST(Status, HasModelAddressAndState) {
  DaemonSetup setup;
  setup.moving_object = true;
  Daemon daemon(setup);
  Client client(daemon.address());
  client.fire(fire_at(PingRate::hz40, 3));
  for (int i = 0; i < 2; ++i)
    ASSERT_TRUE(sees_range(client, 3));  // the first ping is counted as served when the second is written
  const v1::DaemonStatus s = daemon.status();
  EXPECT_FALSE(s.version().empty());
  EXPECT_EQ(s.config(), "test.yaml");
  EXPECT_THAT(s.scene(), HasSubstr("scene.yaml"));
  EXPECT_EQ(s.clock(), "realtime");
  EXPECT_EQ(s.engine(), "fake");
  EXPECT_GT(s.uptime_s(), 0);
  EXPECT_GT(s.resident_mb(), 1);
  ASSERT_EQ(s.sonars_size(), 1);
  const v1::SonarStatus& sonar = s.sonars(0);
  EXPECT_EQ(sonar.name(), "front");
  EXPECT_EQ(sonar.profile(), "oculus-m1200d");
  EXPECT_EQ(sonar.listens(), daemon.address() + ":52100");
  EXPECT_EQ(sonar.advertised(), daemon.address());
  EXPECT_THAT(sonar.status_to(), ElementsAre(daemon.address() + ":9"));
  EXPECT_TRUE(sonar.pinging());
  EXPECT_TRUE(sonar.transmits());
  EXPECT_EQ(sonar.range_m(), 3);
  EXPECT_NEAR(sonar.rate_hz(), 40, 1e-3);
  EXPECT_EQ(sonar.beams(), 256u);
  EXPECT_GT(sonar.rows(), 0u);
  EXPECT_NEAR(sonar.frequency_hz(), 2.1e6, 1e5);
  EXPECT_EQ(sonar.position().z(), -3);
  ASSERT_EQ(sonar.clients_size(), 1);
  EXPECT_GT(sonar.clients(0).pings_written(), 0u);
  EXPECT_GT(sonar.clients(0).bytes_written(), 0u);
  EXPECT_GT(sonar.figures().pings(), 0u);
  EXPECT_EQ(sonar.figures().clients(), 1u);
  ASSERT_EQ(s.vehicles_size(), 1);
  EXPECT_EQ(s.vehicles(0).source(), "initial pose");
  ASSERT_EQ(s.objects_size(), 3);
  EXPECT_EQ(s.objects(0).name(), "floor");
  EXPECT_EQ(s.objects(0).material(), "mud");
  EXPECT_EQ(s.objects(0).triangles(), 2u);
  EXPECT_FALSE(s.objects(1).moving());
  EXPECT_TRUE(s.objects(2).moving());
  EXPECT_EQ(s.objects(2).position().x(), 5);
  EXPECT_EQ(s.environment().temperature_c().value(), 12);
}

TEST(SetSonar, AffectsTheNextPingAndIsEchoedAsAFireMessage) {
  Daemon daemon;
  Client client(daemon.address());
  oculus::FireRequest fire = fire_at(PingRate::hz40, 3);
  fire.settings.gamma = 77;
  client.fire(fire);
  ASSERT_TRUE(sees_range(client, 3));
  control::SetSonar asked = set_range(5.5);
  asked.gain_percent = 20;
  asked.beams = 512;
  asked.sonar = "front";
  EXPECT_EQ(daemon.ask(asked).code, Code::done);
  const std::size_t asked_by_now = daemon.requests().size() + 1;  // a request may be on its way to the engine
  ASSERT_TRUE(sees(client, [](const oculus::DecodedPing& p) {
    return p.head.fixed.fire.range == 5.5 && p.head.fixed.fire.gain_percent != 50 && p.beams() == 512 &&
           p.head.fixed.fire.gamma == 77;
  })) << "settings that control did not change are those of the client";
  const auto requests = daemon.requests();
  for (std::size_t i = asked_by_now; i < requests.size(); ++i) EXPECT_EQ(requests[i].settings.range_m, 5.5);
  EXPECT_THAT(daemon.log_text(), HasSubstr("client=\"control test\""));
}

TEST(SetSonar, TheLastRequestWins) {
  Daemon daemon;
  Client client(daemon.address());
  client.fire(fire_at(PingRate::hz40, 3));
  ASSERT_TRUE(sees_range(client, 3));
  ASSERT_EQ(daemon.ask(set_range(4)).code, Code::done);
  ASSERT_TRUE(sees_range(client, 4));
  client.fire(fire_at(PingRate::hz40, 3));
  ASSERT_TRUE(sees_range(client, 3));
  for (int i = 0; i < 5; ++i) EXPECT_EQ(client.next_ping()->head.fixed.fire.range, 3);
}

TEST(SetSonar, TransmitFalseOverridesClients) {
  Daemon daemon;
  ASSERT_EQ(daemon.ask(set_transmit(false)).code, Code::done);
  Client client(daemon.address());
  client.fire(fire_at(PingRate::hz40, 3));
  ASSERT_TRUE(sees_range(client, 3));
  client.fire(fire_at(PingRate::hz40, 4));
  ASSERT_TRUE(sees_range(client, 4));
  for (const PingRequest& r : daemon.requests()) EXPECT_TRUE(r.blank);
  EXPECT_FALSE(daemon.status().sonars(0).transmits());
  ASSERT_EQ(daemon.ask(set_transmit(true)).code, Code::done);
  const std::size_t by_now = daemon.requests().size();
  EXPECT_TRUE(eventually([&] { return daemon.requests().size() > by_now + 1; }));
  EXPECT_FALSE(daemon.requests().back().blank);
}

TEST(SetSonar, MovesTheSonarOnItsVehicle) {
  Daemon daemon;
  Client client(daemon.address());
  client.fire(fire_at(PingRate::hz40));
  ASSERT_TRUE(client.next_ping());
  control::SetSonar tilt;
  tilt.mount = control::MountChange{Vec3d{0.5, 0, 0}, quat_from_rpy({0, rad_from_deg(30), 0})};
  ASSERT_EQ(daemon.ask(tilt).code, Code::done);
  const std::size_t by_now = daemon.requests().size() + 1;  // a request may be on its way to the engine
  ASSERT_TRUE(eventually([&] { return daemon.requests().size() > by_now; }));
  const Pose sonar = daemon.requests().back().sonar_in_world;
  EXPECT_NEAR(sonar.position_m.x, 0.5, 1e-12);
  EXPECT_NEAR(rpy_from_quat(sonar.orientation).pitch_rad, rad_from_deg(30), 1e-12);

  tilt.mount = control::MountChange{Vec3d{0.7, 0, 0}, {}};  // the angles stay
  ASSERT_EQ(daemon.ask(tilt).code, Code::done);
  ASSERT_TRUE(eventually([&] { return std::abs(daemon.requests().back().sonar_in_world.position_m.x - 0.7) < 1e-12; }));
  EXPECT_NEAR(rpy_from_quat(daemon.requests().back().sonar_in_world.orientation).pitch_rad, rad_from_deg(30), 1e-12);
}

TEST(SetSonar, WrongValuesAreRefusedWithThePermittedOnesAndChangeNothing) {
  Daemon daemon;
  const auto before = daemon.status().sonars(0);
  control::SetSonar wrong = set_range(300);
  wrong.mount = control::MountChange{Vec3d{1, 2, 3}, {}};
  wrong.transmit = false;
  const OperationResult far = daemon.ask(wrong);
  EXPECT_EQ(far.code, Code::refused);
  EXPECT_THAT(far.text, HasSubstr("is 0.1 to 10 m"));
  control::SetSonar stranger = set_range(3);
  stranger.sonar = "rear";
  const OperationResult unknown = daemon.ask(stranger);
  EXPECT_EQ(unknown.code, Code::refused);
  EXPECT_THAT(unknown.text, HasSubstr("no sonar is called \"rear\"; there are: front"));
  const auto after = daemon.status().sonars(0);
  EXPECT_EQ(after.range_m(), before.range_m());
  EXPECT_EQ(after.position().x(), before.position().x());
  EXPECT_TRUE(after.transmits());
}

TEST(SetEnvironment, IsTheWaterOfTheNextPing) {
  Daemon daemon;
  Client client(daemon.address());
  client.fire(fire_at(PingRate::hz40));
  ASSERT_TRUE(client.next_ping());
  const double speed_before = daemon.requests().back().settings.device_sound_speed_mps;
  control::SetEnvironment warm;
  warm.temperature_c = 25;
  ASSERT_EQ(daemon.ask(warm).code, Code::done);
  ASSERT_TRUE(sees(client, [](const oculus::DecodedPing& p) { return p.head.fixed.temperature_c == 25; }));
  const PingRequest last = daemon.requests().back();
  EXPECT_EQ(last.water.temperature_c, 25);
  EXPECT_EQ(last.water.salinity_psu, 30) << "values that are not given stay";
  EXPECT_GT(last.settings.device_sound_speed_mps, speed_before + 20) << "the device's own sound speed follows its thermometer";
  EXPECT_EQ(daemon.status().environment().temperature_c().value(), 25);
}

TEST(SetEnvironment, HoldsTheRulesOfTheConfiguration) {
  Daemon daemon;
  control::SetEnvironment hot;
  hot.temperature_c = 35;
  const OperationResult refused = daemon.ask(hot);
  EXPECT_EQ(refused.code, Code::refused);
  EXPECT_THAT(refused.text, HasSubstr("allow_hot"));
  control::SetEnvironment slow;
  slow.sound_speed_mps = 300;
  EXPECT_THAT(daemon.ask(slow).text, HasSubstr("from 1000 to 2000"));
  EXPECT_EQ(daemon.status().environment().temperature_c().value(), 12);
}

TEST(PosesByControl, AreAcceptedAsAllOtherPoses) {
  Daemon daemon;
  control::PoseSample sample;
  sample.name = "rov";
  sample.pose.position_m = {1, 2, -4};
  EXPECT_EQ(daemon.ask(sample).code, Code::done);
  const v1::DaemonStatus s = daemon.status();
  EXPECT_EQ(s.vehicles(0).position().z(), -4);
  EXPECT_EQ(s.vehicles(0).source(), "control");
  EXPECT_EQ(s.poses().accepted(), 1u);
  sample.name = "rev";
  const OperationResult unknown = daemon.ask(sample);
  EXPECT_EQ(unknown.code, Code::refused);
  EXPECT_THAT(unknown.text, HasSubstr("no vehicle is called \"rev\""));
}

TEST(Health, IsFineAndFiguresAreText) {
  Daemon daemon;
  daemon.on_io_thread([&] {
    EXPECT_THAT(daemon.app().operations().problem(), IsEmpty());
    EXPECT_THAT(daemon.app().operations().metrics(), HasSubstr("sonar=\"front\""));
  });
}

TEST(Events, ReachListenersOnly) {
  DaemonSetup setup;
  setup.more = "poses: {protobuf: off, json: off, stale_after_s: 0.2}\n";
  Daemon daemon(setup);
  std::vector<v1::Event> told;  // on the I/O thread
  Events::Token token;
  daemon.on_io_thread([&] {
    EXPECT_FALSE(daemon.app().events().has_listeners());
    token = daemon.app().events().listen([&](const v1::Event& e) { told.push_back(e); });
    EXPECT_TRUE(daemon.app().events().has_listeners());
  });
  {
    Client client(daemon.address());
    client.fire(fire_at(PingRate::hz40, 3));
    ASSERT_TRUE(sees_range(client, 3));
  }
  control::PoseSample sample;
  ASSERT_EQ(daemon.ask(sample).code, Code::done);
  const auto has = [&](auto&& fits) {
    return eventually([&] {
      bool found = false;
      daemon.on_io_thread([&] { found = std::any_of(told.begin(), told.end(), fits); });
      return found;
    });
  };
  EXPECT_TRUE(has([](const v1::Event& e) { return e.client().connected() && e.client().sonar() == "front"; }));
  EXPECT_TRUE(has([](const v1::Event& e) { return e.has_client() && !e.client().connected() && !e.client().why().empty(); }));
  EXPECT_TRUE(has([](const v1::Event& e) {
    const v1::PingEvent& p = e.ping();
    return p.number() > 0 && p.range_m() == 3 && p.beams() == 256 && p.clients() == 1;
  }));
  EXPECT_TRUE(has([](const v1::Event& e) { return e.pose().vehicle() == "rov" && !e.pose().stale(); }));
  EXPECT_TRUE(has([](const v1::Event& e) { return e.pose().stale(); }));
  daemon.on_io_thread([&] { token.reset(); });
  ASSERT_EQ(daemon.ask(sample).code, Code::done);  // the list is cleaned up before an event is sent
  daemon.stop();
}

TEST(Stepped, BytesAreTheSameWithAnyObservers) {
  const auto digest = [](bool looked_at) {
    DaemonSetup setup;
    setup.more = "clock: stepped\n";
    setup.options.exit_after_pings = 40;
    setup.options.digest = true;
    setup.engine_takes = milliseconds(2);
    Daemon daemon(setup);
    std::uint64_t told = 0;
    Events::Token token;
    if (looked_at) daemon.on_io_thread([&] { token = daemon.app().events().listen([&](const v1::Event&) { ++told; }); });
    Client client(daemon.address());
    client.fire(fire_at(PingRate::hz40));
    std::vector<std::future<OperationResult>> answers;
    if (looked_at)
      for (int i = 0; i < 20; ++i) answers.push_back(daemon.ask_later(control::GetStatus{}));
    EXPECT_TRUE(client.read_to_end());
    EXPECT_EQ(daemon.wait(), 0);
    if (looked_at) {
      EXPECT_GE(told, 40u);
    }
    return daemon.app().devices().front().digests().at(0).sha256;
  };
  EXPECT_EQ(digest(false), digest(true));
}

}  // namespace
}  // namespace sonar::testing_daemon
