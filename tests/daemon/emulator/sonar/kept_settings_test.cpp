// The settings after the last client has left: if the device keeps settings, those of that client, else the initial ones.
#include <gmock/gmock.h>

#include "tests/daemon/emulator/sonar/virtual_time.hpp"

namespace sonar::kept_settings_test {
namespace {

using namespace testing_emulator;
using protocol::Port;
using std::chrono::seconds;

std::string one(std::string_view profile) {
  return yaml_of("  - name: front\n    profile: " + std::string(profile) + "\n    bind_ip: 127.0.0.2\n");
}

TEST(KeptSettings, StayAfterTheLastClientOnlyForMakesThatKeepThem) {
  std::set<std::string_view> keepers;
  for (const protocol::Vendor* vendor : protocol::vendors()) {
    SCOPED_TRACE(vendor->name());
    const Port* const port =
        vendor->port(Port::Kind::tcp_stream) ? vendor->port(Port::Kind::tcp_stream) : vendor->port(Port::Kind::udp_dialogue);
    if (port == nullptr) continue;  // this make has no clients that leave
    VirtualTime time(one(vendor->models().front()->profile));
    Sonar& sonar = time.sonar("front");
    const auto initial = sonar.state().settings;
    const ConnectionId first = time.connect("front", Role::client, port);
    protocol::SettingsOverride range;
    range.range_m = 3;
    ASSERT_TRUE(sonar.change(range, "a client", time.now));
    const auto changed = sonar.state().settings;
    ASSERT_FALSE(changed->equals(*initial));
    time.close(first);
    const ConnectionId next = time.connect("front", Role::client, port);
    EXPECT_EQ(sonar.state().settings->equals(*changed), vendor->keeps_settings());
    EXPECT_EQ(sonar.state().settings->equals(*initial), !vendor->keeps_settings());
    if (!vendor->keeps_settings()) continue;
    keepers.insert(vendor->name());
    FaultRecord forgets;
    forgets.what = "config-forgotten";
    time.add_fault("front", forgets);
    EXPECT_TRUE(sonar.state().settings->equals(*initial)) << "as after a restart";
    time.close(next);
  }
  EXPECT_THAT(keepers, ::testing::ElementsAre("dvl", "micron", "norbit"));
}

TEST(KeptSettings, ASonarThatStartsToPingByItselfUsesThePresentSettings) {
  VirtualTime time(one("ping1d"));
  Sonar& sonar = time.sonar("front");
  const auto initial = sonar.state().settings;
  protocol::SettingsOverride rate;
  rate.rate_hz = 5;
  ASSERT_TRUE(sonar.change(rate, "a client", time.now));
  const auto changed = sonar.state().settings;
  ASSERT_FALSE(changed->equals(*initial));
  sonar.run_itself(true, time.now);
  EXPECT_TRUE(sonar.state().settings->equals(*changed));
  sonar.run_itself(false, time.now);
  EXPECT_TRUE(sonar.state().settings->equals(*initial)) << "as when the last client leaves";
}

/// Drivers of a Norbit: one program sends commands, and others read pings.
struct Norbit : ::testing::Test {
  VirtualTime time{one("norbit-wbms")};
  ConnectionId connect(std::uint16_t number) {
    const auto ports = time.sonar("front").vendor().ports();
    return time.connect("front", Role::client, &*std::ranges::find(ports, number, &Port::number));
  }
  void configure() {
    const ConnectionId commands = connect(2209);
    for (const std::string_view line : {"set_range 0 5\r\n", "set_rate 5\r\n", "set_power 1\r\n"}) {
      const auto bytes = std::as_bytes(std::span(line));
      time.send(commands, {bytes.begin(), bytes.end()});
    }
    time.close(commands);
  }
  void expect_pings(ConnectionId reader) {
    const std::size_t before = time.clients[reader].received.size();
    const std::uint64_t pings = time.pings;
    time.run(seconds(2));
    EXPECT_NEAR(static_cast<double>(time.pings - pings), 10, 1);
    EXPECT_GT(time.clients[reader].received.size(), before);
    EXPECT_NEAR(time.sonar("front").settings().range_m, 5, 0.1);
  }
};

TEST_F(Norbit, MayBeConfiguredByAProgramThatLeavesBeforeAReaderConnects) {
  configure();
  time.run(seconds(1));
  EXPECT_EQ(time.pings, 0u) << "no client reads pings";
  expect_pings(connect(2210));
}

TEST_F(Norbit, MayBeConfiguredByAProgramThatLeavesWhileAReaderWaits) {
  const ConnectionId reader = connect(2210);
  time.run(seconds(1));
  EXPECT_EQ(time.pings, 0u) << "the sonar is initially in standby";
  configure();
  expect_pings(reader);
}

}  // namespace
}  // namespace sonar::kept_settings_test
