// Tests one client and one sonar over loopback: the conversation of a driver with its device.
#include <gmock/gmock.h>

#include "protocol/control/answers.hpp"
#include "tests/daemon/server/loopback.hpp"

namespace sonar::testing_daemon {
namespace {

using oculus::PingRate;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

TEST(Serving, PingsAreValidAndConsecutiveAndEchoTheirRequest) {
  DaemonSetup setup;
  setup.gate = std::make_shared<PingGate>();
  Daemon daemon(setup);
  Client client(daemon.address());
  const auto fire = fire_at(PingRate::hz40);
  client.fire(fire);
  oculus::PingSequence sequence;
  for (std::uint32_t i = 1; i <= 20; ++i) {
    setup.gate->allow();
    const auto ping = client.next_ping();
    ASSERT_TRUE(ping) << "ping " << i;
    EXPECT_EQ(ping->head.fixed.ping_id, i) << "the first ping already answers the request";
    EXPECT_THAT(ping->violations, IsEmpty());
    EXPECT_THAT(oculus::echo_violations(fire, *ping), IsEmpty());
    EXPECT_THAT(sequence.add(*ping), IsEmpty());
    for (const std::size_t row : {std::size_t{0}, ping->rows() - 1})
      for (const std::size_t beam : {std::size_t{0}, ping->beams() - 1})
        EXPECT_EQ(ping->sample(row, beam), FakeEngine::sample(i, row, beam));
  }
  EXPECT_EQ(client.decoder.skipped_bytes(), 0u);
  EXPECT_EQ(daemon.stop(), 0);
  EXPECT_GE(daemon.figures().served, 20u);
  EXPECT_THAT(daemon.log_text(), HasSubstr("client connected"));
  EXPECT_THAT(daemon.log_text(), HasSubstr("settings: mode 2, range 2 m"));
}

TEST(Serving, DummiesAreSentUntilTheFirstFire) {
  DaemonSetup setup;
  setup.sonar_lines = "    options: {dummy_period_ms: 40}\n";
  Daemon daemon(setup);
  Client client(daemon.address());
  for (int i = 0; i < 5; ++i) {
    const auto message = client.next();
    ASSERT_TRUE(message);
    EXPECT_TRUE(std::holds_alternative<oculus::DummyMessage>(*message));
  }
  EXPECT_THAT(daemon.requests(), IsEmpty());
}

TEST(Serving, NoDummyWhileAPingTakesLong) {
  std::promise<void> enough;
  DaemonSetup setup;
  setup.sonar_lines = "    options: {dummy_period_ms: 20}\n";
  setup.engine_before = [until = enough.get_future().share()](std::uint32_t) { until.wait(); };
  Daemon daemon(setup);
  Client client(daemon.address());
  client.fire(fire_at(PingRate::hz10));
  ASSERT_TRUE(eventually([&] { return daemon.log_text().find("settings: mode 2") != std::string::npos; }));
  const auto written = [&] { return daemon.status().sonars().at(0).clients().at(0).bytes_written(); };
  const auto before = written();
  for (const auto until = Steady::now() + milliseconds(1200); Steady::now() < until;) {
    EXPECT_EQ(written(), before) << "a byte was sent between the fire message and its ping";
    std::this_thread::sleep_for(milliseconds(10));
  }
  enough.set_value();
  auto message = client.next();
  while (message && std::holds_alternative<oculus::DummyMessage>(*message))
    message = client.next();  // dummies from before the fire message
  for (int i = 0; i < 5; ++i) {
    ASSERT_TRUE(message);
    EXPECT_TRUE(std::holds_alternative<oculus::DecodedPing>(*message));
    message = client.next();
  }
}

TEST(Serving, OptionPingsBeforeTheFirstFire) {
  DaemonSetup setup;
  setup.sonar_lines = "    options: {before_first_fire: pings}\n";
  Daemon daemon(setup);
  Client client(daemon.address());
  EXPECT_TRUE(client.next_ping());
}

TEST(Serving, StandbyIsAcknowledgedAndAnyRateResumes) {
  DaemonSetup setup;
  setup.sonar_lines = "    options: {dummy_period_ms: 50}\n";
  Daemon daemon(setup);
  Client client(daemon.address());
  client.fire(fire_at(PingRate::hz40));
  ASSERT_TRUE(client.next_ping());
  client.fire(fire_at(PingRate::standby));
  int dummies = 0;
  while (dummies < 4) {  // earlier pings may arrive first, but none between dummies
    const auto message = client.next();
    ASSERT_TRUE(message);
    if (std::holds_alternative<oculus::DummyMessage>(*message)) ++dummies;
    if (std::holds_alternative<oculus::DecodedPing>(*message)) {
      ASSERT_LE(dummies, 1);
    }
  }
  client.fire(fire_at(PingRate::hz40));
  EXPECT_TRUE(client.next_ping());
}

TEST(Serving, NetworkTriggerMeansOnePingPerFire) {
  Daemon daemon;
  Client client(daemon.address());
  auto fire = fire_at(PingRate::hz40);
  fire.settings.flags |= oculus::flag::network_trigger;
  for (std::uint32_t i = 1; i <= 4; ++i) {
    client.fire(fire);
    const auto ping = client.next_ping();
    ASSERT_TRUE(ping);
    EXPECT_EQ(ping->head.fixed.ping_id, i);
  }
  EXPECT_FALSE(client.next_ping(milliseconds(300))) << "no fifth ping was requested";
}

TEST(Serving, RepeatedFireMessagesDoNotRestartTheRhythm) {
  Daemon daemon;
  Client client(daemon.address());
  const auto begin = Steady::now();
  int pings = 0;
  while (pings < 10 &&
         Steady::now() - begin <
             patience) {  // 50 requests per second; if each restarted the timer, pings would be as frequent, or would never come
    client.fire(fire_at(PingRate::hz5));
    if (client.next_ping(milliseconds(20))) ++pings;
  }
  EXPECT_EQ(pings, 10);
  EXPECT_GE(Steady::now() - begin, milliseconds(9 * 200)) << "pings are faster than the rate";
}

TEST(Serving, LateSimulationSkipsTicksAndNeverQueues) {
  DaemonSetup setup;
  setup.gate = std::make_shared<PingGate>();
  Daemon daemon(setup);
  Client client(daemon.address());
  client.fire(fire_at(PingRate::hz40));
  const auto skipped = [&] {
    std::uint64_t busy = 0;
    daemon.on_io_thread([&] { busy = daemon.figures().skipped.busy; });
    return busy;
  };
  for (std::uint32_t i = 1; i <= 4; ++i) {
    ASSERT_TRUE(eventually([&, before = skipped()] { return skipped() >= before + 5; }));
    setup.gate->allow();
    const auto ping = client.next_ping();
    ASSERT_TRUE(ping);
    EXPECT_EQ(ping->head.fixed.ping_id, i) << "ids do not count skipped ticks";
  }
  const auto requests = daemon.requests();
  ASSERT_GE(requests.size(), 4u);
  for (std::size_t i = 1; i < requests.size(); ++i)
    EXPECT_GE(requests[i].fired_at - requests[i - 1].fired_at, 6 * milliseconds(25)) << "a ping was made for an older tick";
}

TEST(Serving, Version2RequestsGetVersion2PingsWithAttitude) {
  Daemon daemon;
  Client client(daemon.address());
  auto fire = fire_at(PingRate::hz10);
  fire.version = 2;
  client.fire(fire);
  const auto ping = client.next_ping();
  ASSERT_TRUE(ping);
  EXPECT_THAT(oculus::echo_violations(fire, *ping), IsEmpty());
  EXPECT_NEAR(ping->head.fixed.heading_deg, 90, 1e-6) << "the vehicle looks along +x of the world, which is east";
}

TEST(Serving, GarbageIsSkippedAndLoggedFewTimes) {
  Daemon daemon;
  const auto begin = Steady::now();
  Client client(daemon.address());
  for (int i = 0; i < 200; ++i) {
    client.send(std::string(100, 'x'));
    std::this_thread::sleep_for(milliseconds(1));
  }
  client.fire(fire_at(PingRate::hz10));
  EXPECT_TRUE(client.next_ping());
  const std::string log = daemon.log_text();
  std::size_t lines = 0;
  for (std::size_t at = log.find("skipped"); at != std::string::npos; at = log.find("skipped", at + 1)) ++lines;
  EXPECT_GE(lines, 1u);
  EXPECT_LE(lines, 30u + static_cast<std::size_t>((Steady::now() - begin) / std::chrono::seconds(1))) << "rate-limited";
}

TEST(Serving, AFailedEngineEndsTheDaemonWithExitCode70) {
  DaemonSetup setup;
  setup.engine_before = [](std::uint32_t ping) {
    if (ping == 3) throw std::runtime_error("out of coffee");
  };
  Daemon daemon(setup);
  Client client(daemon.address());
  client.fire(fire_at(PingRate::hz40));
  EXPECT_EQ(daemon.wait(), 70);
  EXPECT_THAT(daemon.log_text(), HasSubstr("out of coffee"));
}

TEST(Serving, AnEngineWhoseDeviceIsLostEndsTheDaemonWithExitCode69) {
  DaemonSetup setup;
  setup.engine_before = [](std::uint32_t ping) {
    if (ping == 2) throw EngineUnavailable("the device is lost; use --engine cpu");
  };
  Daemon daemon(setup);
  Client client(daemon.address());
  client.fire(fire_at(PingRate::hz40));
  EXPECT_EQ(daemon.wait(), 69);
  EXPECT_THAT(daemon.log_text(), HasSubstr("the ping engine failed: the device is lost; use --engine cpu"));
}

TEST(Serving, APingThatTheEngineRefusesIsDroppedCountedAndLogged) {
  DaemonSetup setup;
  setup.gate = std::make_shared<PingGate>();
  setup.engine_before = [](std::uint32_t ping) {
    if (ping == 2) throw std::invalid_argument("beam_count must be from 1 to 4096");
    if (ping == 4) throw std::bad_alloc();
  };
  Daemon daemon(setup);
  Client client(daemon.address());
  client.fire(fire_at(PingRate::hz40));
  for (const std::uint32_t number : {1u, 3u, 5u, 6u}) {
    setup.gate->allow(number == 3 || number == 5 ? 2 : 1);  // the previous ping is refused
    const auto ping = client.next_ping();
    ASSERT_TRUE(ping);
    EXPECT_EQ(ping->head.fixed.ping_id, number);
  }
  EXPECT_EQ(daemon.stop(), 0);
  EXPECT_EQ(daemon.figures().refused, 2u);
  EXPECT_THAT(daemon.log_text(), HasSubstr("ping dropped: beam_count must be from 1 to 4096"));
  EXPECT_THAT(daemon.log_text(), HasSubstr("ping dropped: out of memory"));
}

TEST(Serving, APingRefusedForEverDoesNotFloodTheLog) {
  DaemonSetup setup;
  setup.engine_before = [](std::uint32_t) { throw std::invalid_argument("no such mode"); };
  Daemon daemon(setup);
  Client client(daemon.address());
  client.fire(fire_at(PingRate::hz40));
  const auto begin = Steady::now();
  ASSERT_TRUE(eventually([&] { return daemon.requests().size() >= 30; }));
  EXPECT_EQ(daemon.stop(), 0);
  const std::string log = daemon.log_text();
  std::size_t lines = 0;
  for (std::size_t at = log.find("ping dropped"); at != std::string::npos; at = log.find("ping dropped", at + 1)) ++lines;
  EXPECT_GE(lines, 5u);
  EXPECT_LE(lines, 6u + static_cast<std::size_t>((Steady::now() - begin) / std::chrono::seconds(1)));
}

TEST(Serving, ExitAfterPingsEndsByItself) {
  DaemonSetup setup;
  setup.options.exit_after_pings = 5;
  Daemon daemon(setup);
  Client client(daemon.address());
  client.fire(fire_at(PingRate::hz40));
  EXPECT_TRUE(client.read_to_end());
  EXPECT_EQ(daemon.wait(), 0);
  EXPECT_GE(daemon.figures().served, 5u);
}

std::string why_not(DaemonSetup setup) {
  try {
    Daemon daemon(std::move(setup));
  } catch (const std::runtime_error& e) {
    return e.what();
  }
  return "opened";
}

TEST(Serving, ErrorsOfAddressesSayWhatToDo) {
  Daemon first;
  DaemonSetup same;
  same.address = first.address();
  const std::string busy = why_not(same);
  EXPECT_THAT(busy, HasSubstr("cannot listen on " + first.address() + ":52100: port in use by another program"));
  EXPECT_THAT(busy, HasSubstr("ss -anp"));
  EXPECT_THAT(busy, HasSubstr("ephemeral range"));
  DaemonSetup foreign;
  foreign.address = "192.0.2.1";  // TEST-NET-1: an address of no host
  foreign.more = "poses: {protobuf: off, json: off}\n";
  EXPECT_THAT(why_not(foreign),
              HasSubstr("192.0.2.1:52100: address not on this host. Add it: ip addr add 192.0.2.1/24 dev eth0"));
}

}  // namespace
}  // namespace sonar::testing_daemon
