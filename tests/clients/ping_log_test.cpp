// Tests the conclusions of `listen` from a stream: counts, gaps, rates and the verdict that decides its exit code.
#include "clients/sonarctl/ping_log.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace sonar::clients::ping_log_test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

HostPing ping(std::uint32_t id, std::vector<std::string> echo_mismatches = {}) {
  HostPing ping;
  ping.facts = {id, 3, 4, 8, 0.5, 2, 2.1e6, 100};
  ping.echo_mismatches = std::move(echo_mismatches);
  return ping;
}

TEST(PingLog, AcceptsAGoodStream) {
  PingLog log;
  for (std::uint32_t i = 0; i < 11; ++i) log.add(ping(100 + i), 0.1 * i);
  const PingSummary s = log.summary(protocol::Host::Counts{});
  EXPECT_EQ(s.pings, 11u);
  EXPECT_EQ(s.echo_satisfied_at, 1u);
  EXPECT_NEAR(s.rate_hz, 10, 1e-9);
  EXPECT_NEAR(s.interval_max_ms, 100, 1e-6);
  EXPECT_THAT(complaints(s, true), ElementsAre());
}

TEST(PingLog, ReportsBrokenIdentities) {
  PingLog log;
  HostPing broken = ping(5);
  broken.errors = {"image_size is 1"};
  log.add(broken, 0);
  EXPECT_THAT(complaints(log.summary(std::nullopt), false), ElementsAre(HasSubstr("1 broken identities")));
}

TEST(PingLog, ReportsWhenSettingsTookEffectAndWhetherTheyStayed) {
  PingLog log;
  log.add(ping(1, {"range is 5 m, not 2 m"}), 0);
  EXPECT_THAT(complaints(log.summary(std::nullopt), true), ElementsAre(HasSubstr("never matched the request")));
  log.add(ping(2), 0.1);
  EXPECT_EQ(log.summary(std::nullopt).echo_satisfied_at, 2u);
  EXPECT_THAT(complaints(log.summary(std::nullopt), true), ElementsAre());
  log.add(ping(3, {"range is 5 m, not 2 m"}), 0.2);
  EXPECT_THAT(complaints(log.summary(std::nullopt), true), ElementsAre(HasSubstr("lost again in 1 pings")));
}

TEST(PingLog, ReportsSettingsThatTheSonarLimited) {
  PingLog log;
  HostPing limited = ping(1);
  limited.limited = {"range 40.00 m, not 1000 m", "256 beams, not 512"};
  log.add(limited, 0);
  const PingSummary s = log.summary(std::nullopt);
  EXPECT_THAT(
      text_from(s, true, "Hz"),
      HasSubstr(
          "\nsettings echoed as requested: ping 1, but the sonar limits them: its pings have range 40.00 m, not 1000 m; 256 "
          "beams, not 512"));
  EXPECT_THAT(text_from(s, false, "Hz"), HasSubstr("\nthe sonar's pings have range 40.00 m, not 1000 m"));
  EXPECT_THAT(json_from(s, true), HasSubstr("\"limited\":[\"range 40.00 m, not 1000 m\""));
  EXPECT_THAT(complaints(s, true), ElementsAre()) << "the settings were echoed";
  log.add(ping(2), 0.1);
  EXPECT_THAT(text_from(log.summary(std::nullopt), true, "Hz"), Not(HasSubstr("limits them")));
}

TEST(NoticeLog, KeepsTheFirstOfAKindAndThenFew) {
  NoticeLog log;
  std::vector<std::string> kept;
  for (int i = 1; i <= 1000; ++i)
    for (const std::string& line : log.kept({"ping " + std::to_string(i) + " is late"})) kept.push_back(line);
  EXPECT_THAT(
      kept, ElementsAre("ping 1 is late", "ping 2 is late", "ping 3 is late", "ping 10 is late  (the 10th message of this kind)",
                        HasSubstr("the 100th"), HasSubstr("the 1000th")));
  EXPECT_THAT(log.kept({"ping 9 is early"}), ElementsAre("ping 9 is early")) << "a message of another kind";
  EXPECT_THAT(log.rest(), ElementsAre()) << "all of them have been reported";
  log.kept({"ping 1001 is late"});
  EXPECT_THAT(log.rest(), ElementsAre("ping 1001 is late  (the last of 1001 messages of this kind)"));
  for (int i = 0; i < 200; ++i) log.kept({"kind " + std::string(static_cast<std::size_t>(i), 'x')});
  EXPECT_THAT(log.kept({"one kind too many"}), ElementsAre());
  EXPECT_THAT(log.rest(), testing::Contains("one kind too many  (the last of 103 messages of further kinds)"));
}

TEST(PingLog, ReportsSilenceAndJunk) {
  const protocol::Host::Counts junk{0, 0, 3, 0};
  EXPECT_THAT(complaints(PingLog().summary(junk), true), ElementsAre("no ping arrived", HasSubstr("3 bytes between messages")));
}

TEST(PingLog, PrintsTextAndJson) {
  PingLog log;
  log.add(ping(77), 0);
  EXPECT_THAT(line_from(ping(77)), HasSubstr("ping 77  4 x 3  8 bit  2.00 m"));
  EXPECT_THAT(json_from(ping(77), 0), HasSubstr("\"ping\":77"));
  const protocol::Host::Counts counts{1, 0, 0, 5};
  EXPECT_THAT(text_from(log.summary(counts), true, "Hz"),
              testing::AllOf(HasSubstr("echoed as requested: ping 1"), HasSubstr("missing ids 5")));
  EXPECT_THAT(json_from(log.summary(counts), true),
              testing::AllOf(HasSubstr("\"echo_satisfied_at\":1"), HasSubstr("\"missing_ids\":5")));
  EXPECT_THAT(json_from(log.summary(std::nullopt), false), HasSubstr("\"missing_ids\":null")) << "this wire has no ping numbers";
}

TEST(PingLog, ReportsTheRateInTheUnitOfTheMake) {
  PingLog log;
  for (std::uint32_t i = 0; i < 11; ++i) log.add(ping(i), 0.1 * i);
  EXPECT_THAT(text_from(log.summary(std::nullopt), false, "lines/s"), HasSubstr("rate 10.00 lines/s, interval p50 100.0 ms"));
}

TEST(Percentile, UsesTheNearestRank) {
  EXPECT_EQ(percentile({}, 0.5), 0);
  EXPECT_EQ(percentile({3, 1, 2}, 0.5), 2);
  EXPECT_EQ(percentile({3, 1, 2}, 1), 3);
}

}  // namespace
}  // namespace sonar::clients::ping_log_test
