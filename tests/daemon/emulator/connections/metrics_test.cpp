// Histograms and the Prometheus text: bounds, quantiles, escaping, and lines that a scraper accepts.
#include "daemon/emulator/connections/outbox.hpp"

#include "daemon/server/control/prometheus.hpp"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <regex>
#include <set>
#include <sstream>

#include "daemon/emulator/connections/pacer.hpp"

namespace sonar {
namespace {

using ::testing::HasSubstr;

TEST(RecentRate, IsThatOfTheLastSecondsAndZeroOnceThePingsHaveStopped) {
  RecentRate rate;
  const Time begin{std::chrono::seconds(1000)};
  EXPECT_EQ(rate.hz(begin), 0) << "no ping was made";
  for (int i = 0; i <= 200; ++i) rate.add(begin + i * std::chrono::milliseconds(10));
  const Time quick_end = begin + std::chrono::seconds(2);
  EXPECT_DOUBLE_EQ(rate.hz(quick_end), 100);
  EXPECT_DOUBLE_EQ(rate.hz(quick_end + std::chrono::milliseconds(1900)), 100) << "the next ping may still come";
  EXPECT_EQ(rate.hz(quick_end + std::chrono::milliseconds(2100)), 0);
  for (int i = 1; i <= 10; ++i) rate.add(quick_end + i * std::chrono::seconds(1));
  EXPECT_DOUBLE_EQ(rate.hz(quick_end + std::chrono::seconds(10)), 1) << "pings before the pause do not count";
  rate.add(quick_end + std::chrono::seconds(40));
  rate.add(quick_end + std::chrono::seconds(60));
  EXPECT_DOUBLE_EQ(rate.hz(quick_end + std::chrono::seconds(70)), 0.05) << "rare pings also have a rate";
}

TEST(Histogram, ATimeOnABoundIsInTheLowerBin) {
  Histogram h;
  h.add(0.001);
  h.add(0.0011);
  h.add(-3);
  h.add(1e9);
  EXPECT_EQ(h.counts()[3], 1u);
  EXPECT_EQ(h.counts()[4], 1u);
  EXPECT_EQ(h.counts()[0], 1u) << "a negative time counts as 0";
  EXPECT_EQ(h.counts().back(), 1u);
  EXPECT_EQ(h.count(), 4u);
  EXPECT_DOUBLE_EQ(h.sum_s(), 1e9 + 0.0021);
}

TEST(Histogram, QuantilesLieInTheRightBin) {
  Histogram h;
  EXPECT_EQ(h.quantile_s(0.5), 0);
  for (int i = 0; i < 99; ++i) h.add(0.015);
  h.add(0.3);
  EXPECT_GT(h.quantile_s(0.5), 0.01);
  EXPECT_LE(h.quantile_s(0.5), 0.02);
  EXPECT_LE(h.quantile_s(0.99), 0.02);
  EXPECT_GT(h.quantile_s(0.995), 0.2);
  EXPECT_LE(h.quantile_s(1), 0.5);
  h.add(100);
  EXPECT_EQ(h.quantile_s(1), 10) << "beyond all bounds";
}

TEST(Prometheus, EscapesLabelsAndHelp) {
  PrometheusText text;
  text.family("a_total", PrometheusText::Type::counter, "one\nline, one \\ and \"quotes\"");
  text.sample({{"sonar", "fro\"nt\\\n"}, {"b", ""}}, 3);
  EXPECT_EQ(text.take(),
            "# HELP a_total one\\nline, one \\\\ and \"quotes\"\n# TYPE a_total counter\n"
            "a_total{sonar=\"fro\\\"nt\\\\\\n\",b=\"\"} 3\n");
}

TEST(Prometheus, NumbersKeepTheirDigits) {
  PrometheusText text;
  text.family("a", PrometheusText::Type::gauge, "h");
  text.sample({}, 9007199254740991.0);
  text.sample({}, 0.125);
  EXPECT_THAT(text.take(), HasSubstr("a 9007199254740991\na 0.125\n"));
}

TEST(Prometheus, HistogramsAreCumulative) {
  PrometheusText text;
  Histogram h;
  h.add(0.0004);
  h.add(0.04);
  h.add(50);
  text.family("t_seconds", PrometheusText::Type::histogram, "h");
  text.sample({{"sonar", "front"}}, h);
  const std::string all = text.take();
  EXPECT_THAT(all, HasSubstr("t_seconds_bucket{sonar=\"front\",le=\"0.0002\"} 0\n"));
  EXPECT_THAT(all, HasSubstr("t_seconds_bucket{sonar=\"front\",le=\"0.0005\"} 1\n"));
  EXPECT_THAT(all, HasSubstr("t_seconds_bucket{sonar=\"front\",le=\"10\"} 2\n"));
  EXPECT_THAT(all, HasSubstr("t_seconds_bucket{sonar=\"front\",le=\"+Inf\"} 3\n"));
  EXPECT_THAT(all, HasSubstr("t_seconds_sum{sonar=\"front\"} 50.0404\nt_seconds_count{sonar=\"front\"} 3\n"));
}

DaemonFigures two_sonars() {
  DaemonFigures f;
  f.version = "1.2.3";
  f.sonars = {{"front", {}}, {"side", {}}};
  f.sonars[0].second.pings = 7;
  f.sonars[1].second.dropped_by[static_cast<std::size_t>(DropReason::gone)] = 4;
  f.sonars[1].second.skipped.busy = 5;
  f.poses.late = 6;
  f.links = {{.endpoint = "udpin:127.0.0.1:14551", .vehicle = "rov", .sent = 9, .unaddressed = 3}};
  f.refused_for_descriptors = 8;
  return f;
}

TEST(Prometheus, LabelsEverySonar) {
  const std::string text = metrics_text(two_sonars());
  EXPECT_THAT(text, HasSubstr("sonard_pings_total{sonar=\"front\"} 7\nsonard_pings_total{sonar=\"side\"} 0\n"));
  EXPECT_THAT(text, HasSubstr("sonard_pings_dropped_total{sonar=\"side\",reason=\"gone\"} 4\n"));
  EXPECT_THAT(text, HasSubstr("sonard_ticks_skipped_total{sonar=\"side\",reason=\"busy\"} 5\n"));
  EXPECT_THAT(text, HasSubstr("sonard_poses_total{outcome=\"late\"} 6\n"));
  EXPECT_THAT(text, HasSubstr("sonard_distances_sent_total{link=\"udpin:127.0.0.1:14551\"} 9\n"));
  EXPECT_THAT(text, HasSubstr("sonard_distances_dropped_total{link=\"udpin:127.0.0.1:14551\",reason=\"no_vehicle\"} 3\n"));
  EXPECT_THAT(text, HasSubstr("sonard_connections_refused_total{reason=\"descriptors\"} 8\n"));
  EXPECT_THAT(text, HasSubstr("sonard_build_info{version=\"1.2.3\"} 1\n"));
}

/// The rules of the text format that a scraper enforces.
TEST(Prometheus, EveryLineIsWellFormedAndFamiliesStayTogether) {
  const std::regex head(R"(# (HELP|TYPE) ([a-z_]+) .+)");
  const std::regex sample(R"re(([a-z_]+?)(_bucket|_sum|_count)?(\{[a-z]+="[^"]*"(,[a-z]+="[^"]*")*\})? [0-9.e+-]+)re");
  std::istringstream lines(metrics_text(two_sonars()));
  std::set<std::string> begun;
  std::string family;
  int samples = 0;
  for (std::string line; std::getline(lines, line);) {
    std::smatch m;
    if (std::regex_match(line, m, head)) {
      if (m[1] == "HELP") {
        EXPECT_TRUE(begun.insert(m[2]).second) << line;
      }
      family = m[2];
      continue;
    }
    ASSERT_TRUE(std::regex_match(line, m, sample)) << line;
    EXPECT_TRUE(m[1] == family || m[1].str() + m[2].str() == family) << line << " under " << family;
    ++samples;
  }
  EXPECT_GT(samples, 150);
}

TEST(ProcessFigures, CountWhatThisProcessHas) {
  const ProcessFigures before = figures_of_this_process();
  EXPECT_GT(before.resident_bytes, 1u << 20);
  EXPECT_GE(before.threads, 1u);
  EXPECT_GT(before.descriptor_limit, before.open_descriptors);
  const int fd = open("/dev/null", O_RDONLY);
  EXPECT_EQ(figures_of_this_process().open_descriptors, before.open_descriptors + 1);
  close(fd);
  EXPECT_EQ(figures_of_this_process().open_descriptors, before.open_descriptors);
}

}  // namespace
}  // namespace sonar
