// What listen concludes from a stream: counts, gaps, rates and the verdict that decides its exit code.
#include "clients/sonarctl/ping_log.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>

namespace sonar::clients::ping_log_test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

oculus::FireRequest asked() {
  oculus::FireRequest fire;
  fire.settings.mode = 2;
  fire.settings.flags = oculus::flag::range_in_metres | oculus::flag::simple_result | oculus::flag::gain_assist;
  fire.settings.range = 2;
  fire.settings.gain_percent = 50;
  fire.settings.sound_speed_mps = 1500;
  return fire;
}

oculus::DecodedPing ping(std::uint32_t id, const oculus::FireRequest& echo) {
  oculus::PingHead head;
  head.fixed.header.source = 7001;
  head.fixed.header.type = oculus::MessageType::ping_result;
  head.fixed.fire = echo.settings;
  head.fixed.ping_id = id;
  head.fixed.frequency_hz = 2.1e6;
  head.fixed.sound_speed_mps = 1500;
  head.fixed.range_resolution_m = 0.5;
  head.fixed.row_count = 4;
  head.fixed.beam_count = 3;
  const std::array<std::int16_t, 3> bearings{-3000, 0, 3000};
  const std::array<std::byte, 12> samples{};
  return *oculus::decode_ping(oculus::encode_ping(head, {bearings, {}, samples}));
}

TEST(PingLog, IsContentWithASoundStream) {
  PingLog log(asked());
  for (std::uint32_t i = 0; i < 11; ++i) {
    const PingReport report = log.add(ping(100 + i, asked()), 0.1 * i);
    EXPECT_THAT(report.errors, ElementsAre());
    EXPECT_THAT(report.echo_mismatches, ElementsAre());
  }
  const PingSummary s = log.summary(0);
  EXPECT_EQ(s.pings, 11u);
  EXPECT_EQ(s.missing_ids, 0u);
  EXPECT_EQ(s.echo_satisfied_at, 1u);
  EXPECT_NEAR(s.rate_hz, 10, 1e-9);
  EXPECT_NEAR(s.interval_max_ms, 100, 1e-6);
  EXPECT_THAT(complaints(s, true), ElementsAre());
}

TEST(PingLog, CountsMissingIdsWithoutComplainingAndRefusesFallingOnes) {
  PingLog log(std::nullopt);
  log.add(ping(5, asked()), 0);
  EXPECT_THAT(log.add(ping(9, asked()), 0.1).errors, ElementsAre());
  EXPECT_EQ(log.summary(0).missing_ids, 3u);
  EXPECT_FALSE(log.add(ping(9, asked()), 0.2).errors.empty());
  EXPECT_THAT(complaints(log.summary(0), false), ElementsAre(HasSubstr("broken identities")));
}

TEST(PingLog, TellsWhenTheSettingsTookAndWhetherTheyStayed) {
  oculus::FireRequest other = asked();
  other.settings.range = 5;
  PingLog log(asked());
  EXPECT_THAT(log.add(ping(1, other), 0).echo_mismatches, ElementsAre(HasSubstr("range")));
  EXPECT_THAT(complaints(log.summary(0), true), ElementsAre(HasSubstr("never matched the request")));
  log.add(ping(2, asked()), 0.1);
  EXPECT_EQ(log.summary(0).echo_satisfied_at, 2u);
  EXPECT_THAT(complaints(log.summary(0), true), ElementsAre());
  log.add(ping(3, other), 0.2);
  EXPECT_THAT(complaints(log.summary(0), true), ElementsAre(HasSubstr("lost again in 1 pings")));
}

TEST(PingLog, ComplainsOfSilenceAndJunk) {
  const PingLog log(asked());
  EXPECT_THAT(complaints(log.summary(3), true), ElementsAre("no ping arrived", HasSubstr("3 bytes between messages")));
}

TEST(PingLog, SaysItInTextAndInJson) {
  PingLog log(asked());
  const oculus::DecodedPing p = ping(77, asked());
  const PingReport report = log.add(p, 0);
  EXPECT_THAT(line_from(p, report), HasSubstr("ping 77  4 x 3  8 bit  2.00 m"));
  EXPECT_THAT(json_from(p, report, 0), HasSubstr("\"ping\":77"));
  EXPECT_THAT(text_from(log.summary(0), true), HasSubstr("echoed as asked: ping 1"));
  EXPECT_THAT(json_from(log.summary(0), true), HasSubstr("\"echo_satisfied_at\":1"));
}

TEST(Percentile, TakesTheNearestRank) {
  EXPECT_EQ(percentile({}, 0.5), 0);
  EXPECT_EQ(percentile({3, 1, 2}, 0.5), 2);
  EXPECT_EQ(percentile({3, 1, 2}, 1), 3);
}

}  // namespace
}  // namespace sonar::clients::ping_log_test
