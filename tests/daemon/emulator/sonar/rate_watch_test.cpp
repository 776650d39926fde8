// If computing takes too long for the rate of a sonar, one line reports the possible rate; otherwise there is no line.
#include "daemon/emulator/sonar/ping_source.hpp"

#include <gmock/gmock.h>

namespace sonar::rate_watch_test {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

/// A sonar whose pings are computed one after the other; each takes `ping_s`. `said`: the reports.
struct Sonar {
  double rate_hz, ping_s, waits_s;  // waits_s: per ping, for pings of other sonars
  RateWatch watch{};
  std::uint64_t ticks = 0, busy = 0;
  std::string said{};

  void ping(int times) {
    for (int i = 0; i < times; ++i) {
      const auto periods = static_cast<std::uint64_t>((ping_s + waits_s) * rate_hz) + 1;
      ticks += periods;
      busy += periods - 1;
      if (const auto text = watch.look(ticks, busy, ping_s, rate_hz, waits_s > 0)) said += *text + "\n";
    }
  }
};

TEST(RateWatch, ReportsOnceTheRateThatComputingAllows) {
  Sonar slow{40, 0.052, 0};
  slow.ping(200);
  EXPECT_THAT(slow.said, StartsWith("computing takes 52 ms per ping: 19 Hz at most here, 40 Hz are requested"));
  EXPECT_EQ(std::count(slow.said.begin(), slow.said.end(), '\n'), 1);
}

TEST(RateWatch, DoesNotReportASonarThatKeepsItsRate) {
  Sonar quick{40, 0.024, 0};
  quick.ping(500);
  EXPECT_EQ(quick.said, "");
}

TEST(RateWatch, AFewSlowFirstPingsAreNotReported) {
  Sonar cold{40, 2, 0};
  cold.ping(3);
  cold.ping_s = 0.02;
  cold.ping(500);
  EXPECT_EQ(cold.said, "");
}

TEST(RateWatch, AccountsForOtherSonars) {
  Sonar one_of_three{20, 0.03, 0.06};
  one_of_three.ping(200);
  EXPECT_THAT(one_of_three.said, HasSubstr("30 ms per ping, and other sonars are computed in between: 10 Hz at most here"));
}

TEST(RateWatch, WithoutOtherSonarsReportsTheSlowestPing) {
  Sonar uneven{20, 0.02, 0};
  for (int i = 0; i < 50; ++i) {
    uneven.ping_s = 0.02;
    uneven.ping(2);
    uneven.ping_s = 0.09;
    uneven.ping(1);
  }
  EXPECT_THAT(uneven.said, HasSubstr(" ms per ping, single pings up to 90 ms: 15 Hz at most here, 20 Hz are requested"));
}

TEST(RateWatch, AnotherRateIsCheckedAnew) {
  Sonar sonar{10, 0.052, 0};
  sonar.ping(100);
  EXPECT_EQ(sonar.said, "");
  sonar.rate_hz = 40;
  sonar.ping(100);
  EXPECT_THAT(sonar.said, HasSubstr("19 Hz at most here"));
}

}  // namespace
}  // namespace sonar::rate_watch_test
