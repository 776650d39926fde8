// A range finder that pings by itself, without a client, in virtual time: the times of its pings, its distances, faults.
#include <gmock/gmock.h>

#include "tests/daemon/emulator/sonar/virtual_time.hpp"

namespace sonar::range_finder_test {
namespace {

using namespace testing_emulator;
using std::chrono::milliseconds;
using std::chrono::seconds;

struct RangeFinder : ::testing::Test {
  VirtualTime time{yaml_of("  - name: front\n    profile: ping1d\n    bind_ip: 127.0.0.2\n")};
  Sonar& sonar() { return time.sonar("front"); }
  std::size_t pings_in(std::chrono::nanoseconds length) {
    const std::uint64_t before = time.pings;
    time.run(length);
    return time.pings - before;
  }
  void add_fault(const std::string& what, std::map<std::string, std::string> with = {}) {
    FaultRecord record;
    record.what = what;
    record.with = std::move(with);
    time.add_fault("front", record);
  }
  std::size_t distances() const {
    return static_cast<std::size_t>(
        std::count_if(time.distances.begin(), time.distances.end(), [](const auto& d) { return d.has_value(); }));
  }
};

TEST_F(RangeFinder, PingsAtItsRateWhileItRunsItself) {
  EXPECT_EQ(pings_in(seconds(1)), 0u);
  sonar().run_itself(true, time.now);
  EXPECT_NEAR(static_cast<double>(pings_in(seconds(1))), 10, 1);
  sonar().run_itself(true, time.now);
  EXPECT_NEAR(static_cast<double>(pings_in(seconds(1))), 9, 2) << "without an echo, the automatic mode lengthens the range";
  EXPECT_EQ(distances(), time.pings);
  EXPECT_EQ(time.distances.back()->confidence_percent, 0);
  sonar().run_itself(false, time.now);
  EXPECT_EQ(pings_in(seconds(1)), 0u);
}

TEST_F(RangeFinder, AClientSetsThePaceAndFindsTheDeviceAsDelivered) {
  sonar().run_itself(true, time.now);
  time.run(seconds(1));
  EXPECT_GT(sonar().settings().range_m, 5);
  const ConnectionId client = time.connect("front");
  EXPECT_EQ(sonar().settings().range_m, 5);
  EXPECT_EQ(pings_in(seconds(1)), 0u) << "the client has requested no ping";
  time.close(client);
  EXPECT_GE(pings_in(seconds(1)), 6u);
  const ConnectionId observer = time.connect("front", Role::observer);
  EXPECT_GE(pings_in(seconds(1)), 6u);
  time.close(observer);
}

TEST_F(RangeFinder, AWithheldPingHasNoDistance) {
  sonar().run_itself(true, time.now);
  time.run(seconds(1));
  const std::size_t before = distances();
  add_fault("L05");
  EXPECT_GE(pings_in(seconds(1)), 6u);
  EXPECT_EQ(distances(), before);
  time.end_faults("front");
  time.run(seconds(1));
  EXPECT_GT(distances(), before);
}

TEST_F(RangeFinder, FindsItsDistanceInTheSamplesThatAFaultHasChanged) {
  sonar().run_itself(true, time.now);
  time.run(seconds(1));
  ASSERT_EQ(time.distances.back()->confidence_percent, 0) << "samples of 0 have no echo";
  add_fault("saturated", {{"share", "0.1"}});
  time.run(seconds(1));
  EXPECT_EQ(time.distances.back()->confidence_percent, 100);
  time.end_faults("front");
  time.run(seconds(1));
  EXPECT_EQ(time.distances.back()->confidence_percent, 0);
}

}  // namespace
}  // namespace sonar::range_finder_test
