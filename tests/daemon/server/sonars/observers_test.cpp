// Tests that an observer gets the same pings as clients, and changes nothing else.
#include <gmock/gmock.h>

#include <list>

#include "protocol/control/answers.hpp"
#include "tests/daemon/server/loopback.hpp"

namespace sonar::testing_daemon {
namespace {

using oculus::PingRate;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

std::uint16_t observer_port(Daemon& daemon) {
  const std::string at = daemon.status().sonars().at(0).observers();
  EXPECT_THAT(at, HasSubstr(daemon.address() + ":"));
  return static_cast<std::uint16_t>(std::stoi(at.substr(at.find(':') + 1)));
}

TEST(Observers, GetTheDriversPingsAndChangeNothing) {
  Daemon daemon;
  Client driver(daemon.address());
  driver.fire(fire_at(PingRate::hz40, 2));
  ASSERT_TRUE(driver.next_ping());
  Client observer(daemon.address(), observer_port(daemon));
  observer.fire(fire_at(PingRate::hz10, 5));
  for (int i = 0; i < 10; ++i) {
    const auto seen = observer.next_ping();
    ASSERT_TRUE(seen);
    EXPECT_THAT(seen->violations, IsEmpty());
    EXPECT_EQ(seen->head.fixed.fire.range, 2) << "the range that the driver requested";
    EXPECT_EQ(seen->sample(1, 1), FakeEngine::sample(seen->head.fixed.ping_id, 1, 1));
    ASSERT_TRUE(driver.next_ping());
  }
  EXPECT_TRUE(eventually([&] { return daemon.log_text().find("request of an observer ignored") != std::string::npos; }));
  const v1::SonarStatus status = daemon.status().sonars().at(0);
  EXPECT_EQ(status.range_m(), 2);
  EXPECT_EQ(status.observing(), 1u);
  EXPECT_EQ(status.clients_size(), 1);
  Client second(daemon.address());
  second.fire(fire_at(PingRate::hz40));
  EXPECT_TRUE(second.read_to_end()) << "the slot for a driver is still in use";
  EXPECT_EQ(second.bytes_read, 0u);
  std::thread reader([&] { EXPECT_TRUE(observer.read_to_end()) << "the stream ends with a whole message and a FIN"; });
  driver.close();
  EXPECT_EQ(daemon.stop(), 0);
  reader.join();
  const DeviceFigures f = daemon.figures();
  EXPECT_EQ(f.clients, 1u);
  EXPECT_LE(f.offered, f.pings) << "pings are offered to the driver only";
}

TEST(Observers, DoNotTakeTheSlotOfALaterDriver) {
  Daemon daemon;
  Client observer(daemon.address(), observer_port(daemon));
  observer.fire(fire_at(PingRate::hz40, 5));
  const auto first = observer.next();
  ASSERT_TRUE(first);
  EXPECT_TRUE(std::holds_alternative<oculus::DummyMessage>(*first));
  EXPECT_THAT(daemon.requests(), IsEmpty()) << "no ping is made without a driver";
  Client driver(daemon.address());
  driver.fire(fire_at(PingRate::hz40, 3));
  const auto ping = driver.next_ping();
  ASSERT_TRUE(ping);
  EXPECT_EQ(ping->head.fixed.ping_id, 1u);
  EXPECT_EQ(ping->head.fixed.fire.range, 3);
  const auto seen = observer.next_ping();
  ASSERT_TRUE(seen);
  EXPECT_EQ(seen->head.fixed.fire.range, 3);
  driver.close();
  EXPECT_TRUE(eventually([&] { return !daemon.status().sonars().at(0).pinging(); }));
}

TEST(Observers, HaveALimitedNumberOfSlots) {
  DaemonSetup setup;
  setup.sonar_lines = "    observers: {max: 1}\n";
  {
    Daemon daemon(setup);
    Client first(daemon.address(), observer_port(daemon));
    ASSERT_TRUE(first.next());
    Client second(daemon.address(), observer_port(daemon));
    EXPECT_TRUE(second.read_to_end());
    EXPECT_TRUE(first.next()) << "the first observer still receives";
  }
  setup.sonar_lines = "    observers: {max: 0}\n";
  Daemon daemon(setup);
  EXPECT_EQ(daemon.status().sonars().at(0).observers(), "");
}

TEST(Observers, UseNoSlotOfAClient) {
  DaemonSetup setup;
  setup.more = "limits: {clients: 1}\n";
  Daemon daemon(setup);
  Client observer(daemon.address(), observer_port(daemon));
  ASSERT_TRUE(observer.next());
  Client driver(daemon.address());
  driver.fire(fire_at(PingRate::hz40));
  EXPECT_TRUE(driver.next_ping());
  EXPECT_TRUE(observer.next_ping());
}

TEST(Observers, DoNotDelaySteppedTime) {
  DaemonSetup setup;
  setup.more = "clock: stepped\n";
  Daemon daemon(setup);
  Client never_reads(daemon.address(), observer_port(daemon), 4096);
  Client driver(daemon.address());
  driver.fire(fire_at(PingRate::hz40, 4));
  for (int i = 0; i < 100; ++i)
    ASSERT_TRUE(driver.next_ping()) << i;  // megabytes: more than the kernel can store for the observer
}

}  // namespace
}  // namespace sonar::testing_daemon
