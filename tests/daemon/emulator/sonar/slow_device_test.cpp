// A device that needs time between its last echo and its report, in virtual time.
#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "tests/daemon/emulator/sonar/virtual_time.hpp"

namespace sonar::slow_device_test {
namespace {

using namespace testing_emulator;
using std::chrono::milliseconds;
using std::chrono::seconds;

struct SlowDevice : ::testing::Test {
  static std::string dvl(const std::string& options) {
    return yaml_of("  - {name: down, profile: dvl-a50, bind_ip: 127.0.0.2, options: {" + options + "}}\n");
  }
  static std::int64_t microseconds_of(Time at) {
    return std::chrono::duration_cast<std::chrono::microseconds>(at.time_since_epoch()).count();
  }
  /// Returns the velocity reports that the client has received since the last call.
  static std::vector<nlohmann::json> reports(VirtualTime& time, ConnectionId client) {
    protocol::Bytes& received = time.clients[client].received;
    std::vector<nlohmann::json> found;
    std::string line;
    for (const std::byte b : received) {
      line += static_cast<char>(b);
      if (b != std::byte{'\n'}) continue;
      auto message = nlohmann::json::parse(line);
      if (message["type"] == "velocity") found.push_back(std::move(message));
      line.clear();
    }
    EXPECT_TRUE(line.empty()) << "the last line is incomplete";
    received.clear();
    return found;
  }
};

TEST_F(SlowDevice, AReportLeavesAtTheTimeThatItStates) {
  VirtualTime time(dvl("report_delay_ms: 150"));
  const ConnectionId client = time.connect("down");
  std::size_t count = 0;
  for (int ms = 0; ms < 3000; ++ms) {
    time.run(milliseconds(1));
    for (const auto& report : reports(time, client)) {
      const auto sent = report["time_of_transmission"].get<std::int64_t>(),
                 valid = report["time_of_validity"].get<std::int64_t>();
      EXPECT_GE(microseconds_of(time.now), sent);
      EXPECT_LE(microseconds_of(time.now) - sent, 1001);
      EXPECT_GE(sent - valid, 150'000) << "the delay, and the travel time of the echo";
      EXPECT_LE(sent - valid, 250'000);
      ++count;
    }
  }
  EXPECT_GE(count, 10u);
}

TEST_F(SlowDevice, WithoutADelayAReportLeavesWithItsPing) {
  VirtualTime time(dvl(""));
  const ConnectionId client = time.connect("down");
  time.run(milliseconds(1));
  const auto first = reports(time, client);
  ASSERT_EQ(first.size(), 1u);
  EXPECT_GT(first[0]["time_of_transmission"].get<std::int64_t>(), microseconds_of(time.now))
      << "without a delay, only the stamp is later";
}

/// Waiting reports of a slow device do not accumulate.
TEST_F(SlowDevice, AClientThatDoesNotReadLosesTheOldestReports) {
  VirtualTime time(dvl("report_delay_ms: 150"));
  const ConnectionId client = time.connect("down");
  time.clients[client].reads = false;
  time.run(seconds(30));
  time.clients[client].reads = true;
  time.run(milliseconds(1));
  const std::size_t count = reports(time, client).size();
  EXPECT_GE(count, 1u) << "the newest reports wait";
  EXPECT_LE(count, static_cast<std::size_t>(time.sonar("down").config().outbox.depth) + 2);
}

/// While reports for the previous client wait, a new client connects; it gets only pings fired after it connected.
TEST_F(SlowDevice, UnsentReportsAreLostWithTheLastClient) {
  VirtualTime time(dvl("report_delay_ms: 800"));
  const Sonar& sonar = time.sonar("down");
  const ConnectionId first = time.connect("down"), other = time.connect("down");
  time.run(seconds(3));
  ASSERT_FALSE(reports(time, first).empty());
  time.close(other);
  EXPECT_EQ(sonar.figures().unwanted, 0u) << "another client is served";
  time.close(first);
  const std::uint64_t lost = sonar.figures().unwanted;
  EXPECT_GE(lost, 1u) << "reports waited";
  time.run(milliseconds(100));
  const std::int64_t connected = microseconds_of(time.now);
  const ConnectionId next = time.connect("down");
  time.run(seconds(3));
  const auto received = reports(time, next);
  ASSERT_FALSE(received.empty());
  for (const auto& report : received) EXPECT_GE(report["time_of_validity"].get<std::int64_t>(), connected);
  EXPECT_EQ(sonar.figures().unwanted, lost);
}

TEST_F(SlowDevice, UnsentReportsAreLostInATakeOver) {
  VirtualTime time(dvl("report_delay_ms: 800}, clients: {max: 1, when_full: take_over"));
  time.connect("down");
  time.run(seconds(3));
  const std::int64_t connected = microseconds_of(time.now);
  const ConnectionId next = time.connect("down");
  EXPECT_GE(time.sonar("down").figures().unwanted, 1u);
  time.run(seconds(3));
  const auto received = reports(time, next);
  ASSERT_FALSE(received.empty());
  for (const auto& report : received) EXPECT_GE(report["time_of_validity"].get<std::int64_t>(), connected);
}

TEST_F(SlowDevice, AStopCountsItsUnsentReports) {
  VirtualTime time(dvl("report_delay_ms: 800"));
  time.connect("down");
  time.run(seconds(3));
  Sonar& sonar = time.sonar("down");
  ASSERT_TRUE(sonar.next_conversation());
  sonar.stop("the test ends");
  EXPECT_GE(sonar.figures().unwanted, 1u);
}

/// The end of a fault does not release reports before the time at which the device sends them.
TEST_F(SlowDevice, AFaultDelaysAReportFurther) {
  VirtualTime time(dvl("report_delay_ms: 150"));
  const ConnectionId client = time.connect("down");
  time.run(seconds(1));
  reports(time, client);
  FaultRecord record;
  record.what = "delayed-delivery";
  time.add_fault("down", record);
  std::size_t count = 0;
  for (int ms = 0; ms < 2000; ++ms) {
    if (ms == 1000) time.end_faults("down");
    time.run(milliseconds(1));
    for (const auto& report : reports(time, client)) {
      EXPECT_GE(microseconds_of(time.now), report["time_of_transmission"].get<std::int64_t>());
      ++count;
    }
  }
  EXPECT_GE(count, 5u);
}

}  // namespace
}  // namespace sonar::slow_device_test
