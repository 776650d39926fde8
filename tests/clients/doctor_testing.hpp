// Facts of a sonar and a daemon without faults, which tests change, and the findings of doctor on them.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "clients/sonarctl/doctor/checks.hpp"
#include "tests/protocol/control/message_from.hpp"

namespace sonar::clients::doctor::tests {

inline ReceivedStatus received(const std::string& from) {
  ReceivedStatus status;
  status.from = status.advertised = from;
  status.device_id = 7001;
  status.size = 142;
  return status;
}

inline SonarFacts healthy_sonar(const std::string& host) {
  SonarFacts sonar;
  sonar.at = {host, 52100};
  sonar.on_this_host = true;
  StreamFacts& s = sonar.stream;
  s.outcome = StreamFacts::Outcome::pings;
  s.asked = true;
  s.first_ping_ms = 96.4, s.beams = 512, s.rows = 437, s.bits = 8;
  s.pings = 15, s.asked_hz = 10, s.rate_hz = 9.98;
  s.latency_p50_ms = 18.2, s.latency_p99_ms = 21.4;
  return sonar;
}

inline std::shared_ptr<const v1::DaemonStatus> daemon_of(const std::string& host) {
  return std::make_shared<v1::DaemonStatus>(control::message_from<v1::DaemonStatus>(
      R"(version: "0.1.0" clock: "realtime" engine: "embree, avx2" vehicles { name: "rov" source: "demo orbit" }
         sonars { name: "front" status_to: "192.0.2.255:52102" rate_hz: 10 listens: ")" +
      host + R"(:52100" advertised: ")" + host + R"(" })"));
}
/// Returns the status of the daemon, to be changed.
inline v1::DaemonStatus& daemon_in(Facts& facts) {
  const auto copy = std::make_shared<v1::DaemonStatus>(*facts.control.status);
  facts.control.status = copy;
  return *copy;
}
/// Lets the daemon report the first sonar, and returns the report, to be changed.
inline v1::SonarStatus& report(Facts& facts) {
  const auto reported = std::make_shared<v1::SonarStatus>(facts.control.status->sonars(0));
  facts.sonars[0].reported = reported;
  return *reported;
}

inline Facts healthy() {
  Facts facts;
  facts.sonars.push_back(healthy_sonar("127.0.0.2"));
  facts.status.received.push_back(received("127.0.0.2"));
  facts.status.waited_s = 2.5;
  facts.control.at = {"127.0.0.1", 14770};
  facts.control.status = daemon_of("127.0.0.2");
  facts.http.at = {"127.0.0.1", 8088};
  facts.http.code = 200;
  facts.http.text = "ok";
  facts.kernel_ports = {true, 32768, 60999, "52100,52102"};
  return facts;
}

/// Expects exactly one finding of that check, and returns it; otherwise returns an empty one.
inline Finding line(const std::vector<Finding>& findings, const std::string& check) {
  std::vector<Finding> found;
  for (const Finding& f : findings)
    if (f.check == check) found.push_back(f);
  EXPECT_EQ(found.size(), 1u) << check << " in\n" << text_from(findings);
  return found.size() == 1 ? found.front() : Finding{};
}
inline Finding line(const Facts& facts, const std::string& check) { return line(run_checks(facts), check); }

inline void expect(const Finding& finding, Level level, const std::string& text, const std::string& cure) {
  EXPECT_EQ(finding.level, level) << finding.text;
  EXPECT_THAT(finding.text, testing::HasSubstr(text));
  if (cure.empty())
    EXPECT_THAT(finding.cure, testing::IsEmpty());
  else
    EXPECT_THAT(finding.cure, testing::HasSubstr(cure));
}

}  // namespace sonar::clients::doctor::tests
