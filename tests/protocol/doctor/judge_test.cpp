// Tests the findings on drivers that doctor derives from the status of a daemon.
#include "protocol/doctor/judge.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/protocol/control/message_from.hpp"

namespace sonar::doctor {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;

const std::string front =
    R"( name: "front" profile: "oculus-m1200d" listens: "127.0.0.2:52100" advertised: "127.0.0.2" transmits: true )";
const std::string pinging = " pinging: true rate_hz: 10 figures { pings: 100 simulation_ms: 20 } ";
const std::string driver =
    R"( clients { address: "127.0.0.1:40122" connected_s: 9 pings_written: 90 bytes_read: 69 requests: 1 } )";
const std::string silent = R"( clients { address: "127.0.0.1:40122" connected_s: 3 )";

v1::DaemonStatus with(const std::string& sonar, const std::string& rest = "", const std::string& clock = "realtime") {
  return control::message_from<v1::DaemonStatus>("uptime_s: 100 now_ns: 41600000000 clock: \"" + clock + "\" sonars {" + front +
                                                 sonar + "} " + rest);
}
v1::DaemonStatus two_seconds_before(v1::DaemonStatus status) {
  status.set_uptime_s(status.uptime_s() - 2);
  return status;
}

/// Returns the only finding of that check that is not in order.
Finding trouble(const std::vector<Finding>& findings, const std::string& check) {
  std::vector<Finding> found;
  std::string all;
  for (const Finding& f : findings) {
    all += f.check + ": " + f.text + "\n";
    if (f.check == check && f.level != Level::ok) found.push_back(f);
  }
  EXPECT_EQ(found.size(), 1u) << check << " in\n" << all;
  return found.size() == 1 ? found.front() : Finding{};
}
Finding trouble(const v1::DaemonStatus& status, const std::string& check) { return trouble(judge(status, nullptr), check); }
std::vector<std::string> troubles(const std::vector<Finding>& findings) {
  std::vector<std::string> texts;
  for (const Finding& f : findings)
    if (f.level != Level::ok) texts.push_back(f.text);
  return texts;
}

bool any_fails(const v1::DaemonStatus& status) {
  const auto findings = judge(status, nullptr);
  return std::any_of(findings.begin(), findings.end(), [](const Finding& f) { return f.level == Level::fail; });
}

TEST(Judge, HasNothingToReportOnADriverThatReads) {
  const v1::DaemonStatus now = with(pinging + driver, R"(vehicles { name: "rov" source: "json 127.0.0.1" } engine: "embree")");
  v1::DaemonStatus before = two_seconds_before(now);
  before.mutable_sonars(0)->mutable_figures()->set_pings(80);
  const std::vector<Finding> findings = judge(now, &before);
  EXPECT_THAT(troubles(findings), IsEmpty());
  EXPECT_GE(findings.size(), 6u);
  for (const Finding& f : findings) EXPECT_THAT(f.cure, IsEmpty());
}

TEST(Judge, MissingDriversAreReported) {
  const Finding f = trouble(with(""), "driver");
  EXPECT_EQ(f.level, Level::warn);
  EXPECT_THAT(f.text, StartsWith("No driver is connected to front"));
  EXPECT_EQ(f.cure, "point a driver at 127.0.0.2, TCP port 52100");
  EXPECT_THAT(trouble(with("preview: true"), "driver").text, HasSubstr("a preview for viewers alone"));
  EXPECT_THAT(
      trouble(with(R"(gone { address: "10.0.0.7:1" why: "closed by the client" utc_ns: 3723000000000 ago_s: 500 })"), "driver")
          .text,
      HasSubstr("the last driver, 10.0.0.7:1, left at 01:02:03 UTC: closed by the client"));
}

TEST(Judge, TheFindingOnAMissingUdpDriverNamesItsPort) {
  const Finding f =
      trouble(judge(control::message_from<v1::DaemonStatus>(R"(clock: "realtime" sonars { name: "scan" profile: "ping360"
      advertised: "127.0.0.3" addresses { protocol: "udp" address: "127.0.0.3:12345" }
      addresses { protocol: "udp" address: "127.0.0.3:30303" } })"),
                    nullptr),
              "driver");
  EXPECT_EQ(f.cure, "point a driver at 127.0.0.3, UDP port 12345");
}

TEST(Judge, ADriverThatSearchedWithoutConnectingIsNamed) {
  const auto texts = troubles(judge(with(R"(searched { address: "10.0.0.7:1" utc_ns: 3723000000000 ago_s: 5 })"), nullptr));
  ASSERT_EQ(texts.size(), 2u);
  EXPECT_THAT(texts[1], AllOf(HasSubstr("10.0.0.7:1 searched"), HasSubstr("has not connected")));
}

TEST(Judge, ADriverAtThePortOfObserversIsNamed) {
  const auto texts = troubles(judge(with(R"(asking_observer: "10.0.0.7:1")"), nullptr));
  ASSERT_EQ(texts.size(), 2u);
  EXPECT_THAT(texts[0], AllOf(HasSubstr("10.0.0.7:1 sends requests"), HasSubstr("observers")));
}

TEST(Judge, ADriverOnAWrongAddressIsNamed) {
  const auto texts_of = [](const Elsewhere& elsewhere) { return troubles(judge(with(""), nullptr, elsewhere)); };
  const SocketLine tries{"10.0.0.5", "192.168.2.3", 40122, 52100, syn_sent, 0};
  const SocketLine held{"127.0.0.1", "127.0.0.9", 40122, 52100, established, 0};
  const SocketLine ours{"127.0.0.1", "127.0.0.2", 40122, 52100, syn_sent, 0},
      web{"10.0.0.5", "192.0.2.3", 40122, 443, syn_sent, 0};
  const auto texts = texts_of({{tries, held, ours, web}, 3});
  ASSERT_EQ(texts.size(), 3u);
  EXPECT_THAT(texts[0], HasSubstr("tries to connect to 192.168.2.3:52100, and nothing answers"));
  EXPECT_THAT(texts[2], HasSubstr("is connected to 127.0.0.9:52100, which is not a sonar of this sonard"));
  EXPECT_THAT(texts_of({{ours, web}, 3}), testing::Contains(HasSubstr("3 connections of programs of this computer failed")));
  EXPECT_EQ(trouble(judge(with(""), nullptr, {{tries}, 0}), "address").cure, "point the driver at 127.0.0.2, TCP port 52100");
  EXPECT_THAT(troubles(judge(with(pinging + driver), nullptr, {{tries}, 3})), IsEmpty());
  const auto refused_by_fault =
      troubles(judge(with("", R"(faults { name: "power-cycle.1" state: "active" })"), nullptr, {{}, 288}));
  EXPECT_THAT(refused_by_fault, testing::Not(testing::Contains(HasSubstr("connections of programs"))));
}

TEST(SocketTable, FailedAttemptsAreCounted) {
  EXPECT_EQ(failed_attempts("Ip: A B\nIp: 1 2\nTcp: RtoMin AttemptFails EstabResets\nTcp: 200 20077 3\nUdp: C\nUdp: 1\n"),
            20077u);
  for (const char* text : {"", "Tcp:", "Tcp: AttemptFails\n", "Tcp: AttemptFails\nTcp: many\n"})
    EXPECT_EQ(failed_attempts(text), 0u);
}

TEST(Judge, ADriverThatNeverFiredIsNamed) {
  const Finding f = trouble(with(silent + "}"), "driver");
  EXPECT_EQ(f.level, Level::fail);
  EXPECT_EQ(f.text, "127.0.0.1:40122 is connected to front and has not asked for pings: it has sent nothing");
  EXPECT_EQ(f.client, "127.0.0.1:40122");
  EXPECT_EQ(f.sonar, "front");
  EXPECT_THAT(
      trouble(with(silent + R"(bytes_read: 12 complaint: "skipped 12 bytes that start no Oculus message" })"), "driver").text,
      HasSubstr("12 bytes, no valid fire message among them (skipped 12 bytes that start no Oculus message)"));
  EXPECT_THAT(troubles(judge(with(R"(clients { address: "127.0.0.1:40122" connected_s: 0.5 } rate_hz: 10)"), nullptr)),
              IsEmpty());
}

TEST(Judge, AConnectionForCommandsNeedsNoPings) {
  const std::string commands = R"(clients { address: "127.0.0.1:40123" connected_s: 9 commands_only: true )";
  EXPECT_THAT(troubles(judge(with(pinging + driver + commands + "}"), nullptr)), IsEmpty());
  EXPECT_THAT(trouble(with(commands + "requests: 1 }"), "driver").text, HasSubstr("but nobody is connected for its pings"));
  EXPECT_EQ(trouble(with(pinging + driver + commands + "unread_s: 8 }"), "read").level, Level::fail);
  EXPECT_THAT(trouble(with(commands + "}"), "driver").text, HasSubstr("has not asked for pings")) << "no client gets pings yet";
}

TEST(Judge, StandbyAndNoiseNameTheirClient) {
  EXPECT_EQ(trouble(with(driver + R"(asked_by: "192.0.2.7:4000")"), "standby").text,
            "front is in standby: its rate is 0, set by 192.0.2.7:4000");
  v1::DaemonStatus silenced = with(pinging + driver + R"(silenced_by: "http 192.0.2.8")");
  silenced.mutable_sonars(0)->set_transmits(false);
  EXPECT_THAT(trouble(silenced, "transmit").text, HasSubstr("noise only; turned off by http 192.0.2.8"));
}

TEST(Judge, ADriverThatDoesNotReadIsNamed) {
  v1::DaemonStatus now =
      with(pinging + silent + "requests: 1 pings_dropped: 28 unread_s: 8 taking: 12896 unsent_bytes: 300000 }");
  EXPECT_EQ(trouble(now, "read").text, "127.0.0.1:40122 has not read for 8 s: 28 pings dropped, 300 kB on the way");
  now.mutable_sonars(0)->mutable_clients(0)->set_unread_s(0.1);
  v1::DaemonStatus before = two_seconds_before(now);
  EXPECT_THAT(troubles(judge(now, &before)), IsEmpty());
  before.mutable_sonars(0)->mutable_clients(0)->set_pings_dropped(20);
  EXPECT_THAT(trouble(judge(now, &before), "read").text,
              HasSubstr("reads too slowly: 8 pings dropped in the last 2 s, 28 since"));
}

TEST(Judge, ARefusedOrWaitingDriverIsNamed) {
  const std::string away = R"(turned_away { address: "10.0.0.7:1" why: "no slot is free" utc_ns: 3723000000000 ago_s: )";
  const Finding f = trouble(with(pinging + driver + away + "5 }"), "places");
  EXPECT_EQ(f.level, Level::fail);
  EXPECT_EQ(f.text, "10.0.0.7:1 was refused by front at 01:02:03 UTC: no slot is free (127.0.0.1:40122)");
  EXPECT_THAT(f.cure, HasSubstr("clients.max"));
  EXPECT_THAT(troubles(judge(with(pinging + driver + away + "90 }"), nullptr)), IsEmpty());
  EXPECT_THAT(trouble(with(pinging + driver + "waiting: 1"), "places").text, HasSubstr("1 client of front waits for a slot"));
}

TEST(Judge, ADisconnectedDriverIsNamed) {
  const std::string gone = R"(gone { address: "10.0.0.7:1" why: "read no byte for 10000 ms" utc_ns: 3723000000000 ago_s: 5 })";
  EXPECT_THAT(trouble(with(pinging + driver + gone), "driver").text,
              HasSubstr("ended at 01:02:03 UTC: read no byte for 10000 ms"));
  EXPECT_FALSE(any_fails(with(pinging + driver + gone)));
  EXPECT_FALSE(any_fails(with(gone)));
}

TEST(Judge, ADriverDisconnectedBeforeItsFirstPingIsNamed) {
  const auto left = [](const std::string& why, const std::string& ago_s) {
    const std::string by_itself = why == "closed by the client" ? " by_itself: true" : "";
    return "gone { address: \"10.0.0.7:1\" why: \"" + why + "\" utc_ns: 3723000000000 without_ping: true ago_s: " + ago_s +
           by_itself + " }";
  };
  const std::string junk = "is not a BVE1 link: a frame has another magic number";
  for (const std::string& others : {std::string(), pinging + driver}) {
    const auto findings = judge(with(others + left(junk, "5")), nullptr);
    const auto found = std::find_if(findings.begin(), findings.end(), [](const Finding& f) { return f.level == Level::fail; });
    ASSERT_NE(found, findings.end());
    EXPECT_EQ(found->text, "The connection of 10.0.0.7:1 ended at 01:02:03 UTC: " + junk + ", before its first ping");
    EXPECT_EQ(found->cure, "send a fire message (type 0x15)");
    EXPECT_FALSE(any_fails(with(others + left(junk, "90"))));
    EXPECT_FALSE(any_fails(with(others + left("closed by the client", "5"))));
  }
}

TEST(Judge, AReconnectedDriverIsOnlyAWarning) {
  const auto left = [](const std::string& address, const std::string& connected_s) {
    return R"(gone { address: ")" + address + R"(" why: "is no link" utc_ns: 3723000000000 without_ping: true ago_s: 2 )" +
           "connected_s: " + connected_s + " }";
  };
  const std::string gone = left("127.0.0.1:1", "5");
  EXPECT_TRUE(any_fails(with(pinging + silent + "}" + gone))) << "a connected driver without a ping is an error";
  EXPECT_TRUE(any_fails(with(pinging + silent + "pings_written: 3 }" + left("127.0.0.1:1", "2.5"))))
      << "another driver of the same host that was connected before";
  const Finding f = trouble(with(pinging + silent + "pings_written: 3 }" + gone), "driver");
  EXPECT_EQ(f.level, Level::warn);
  EXPECT_EQ(f.cure, "");
  EXPECT_TRUE(any_fails(with(pinging + silent + "pings_written: 3 }" + left("127.0.0.9:1", "5"))))
      << "another driver was disconnected";
}

TEST(Judge, ADriverThatAnotherClientReplacedIsNamed) {
  const std::string gone = R"(gone { address: "10.0.0.7:1" why: "another client took over" without_ping: true ago_s: 2 })";
  EXPECT_EQ(trouble(with(pinging + driver + gone), "driver").level, Level::warn);
}

/// The driver reacted correctly; the fault itself is reported as long as it is active.
TEST(Judge, ADriverThatAFaultDisconnectedIsNamed) {
  const Finding f =
      trouble(with(pinging + driver + R"(gone { address: "10.0.0.7:1" why: "a fault" without_ping: true ago_s: 5 })"), "driver");
  EXPECT_EQ(f.level, Level::warn);
  EXPECT_EQ(f.cure, "");
}

TEST(Judge, PosesThatStopOrComeTooLateAreReported) {
  const v1::DaemonStatus now =
      with(pinging + driver, R"(vehicles { name: "rov" source: "json 10.0.0.9" stale: true } poses { late: 12 })");
  EXPECT_THAT(trouble(now, "poses").text, HasSubstr("poses of rov have stopped, the last came from json 10.0.0.9"));
  v1::DaemonStatus before = two_seconds_before(now);
  before.mutable_poses()->set_late(2);
  EXPECT_THAT(troubles(judge(now, &before)), testing::Contains(HasSubstr("10 poses came too late")));
  EXPECT_THAT(trouble(with(pinging + driver, R"(notes { text: "odd" cure: "even" })"), "note").cure, "even");
}

TEST(Judge, AnEngineThatIsTooSlowIsReported) {
  v1::DaemonStatus now = with(" pinging: true rate_hz: 10 figures { pings: 114 simulation_ms: 138 skipped_ticks: 30 } " + driver);
  v1::DaemonStatus before = two_seconds_before(now);
  before.mutable_sonars(0)->mutable_figures()->set_pings(100);
  before.mutable_sonars(0)->mutable_figures()->set_skipped_ticks(24);
  const Finding f = trouble(judge(now, &before), "rate");
  EXPECT_EQ(f.text, "front makes 7.0 of 10 Hz: computing takes 138 ms");
  EXPECT_EQ(f.cure, less_to_compute);
  now.mutable_sonars(0)->set_profile("omniscan-450");
  EXPECT_EQ(trouble(judge(now, &before), "rate").text, "front makes 7.0 of 10 lines/s: computing takes 138 ms");
  before.mutable_sonars(0)->mutable_figures()->set_skipped_ticks(30);  // the host of this sonar requested no further pings
  EXPECT_THAT(troubles(judge(now, &before)), IsEmpty());
  now.mutable_sonars(0)->mutable_figures()->set_refused(3);
  EXPECT_EQ(trouble(judge(now, &before), "rate").text, "The engine refused 3 pings of front");
}

TEST(Judge, TheReasonWhyTimeStandsStillIsNamed) {
  const std::string slow = pinging + silent + "requests: 1 unread_s: 8 taking: 12896 }";
  EXPECT_EQ(trouble(with(slow, "", "stepped"), "clock").text,
            "Time stands still at 41.600 s: it moves when 127.0.0.1:40122 has taken ping 12896; it has not read for 8 s");
  const auto stands = [](const std::string& clock, const std::string& poses = "poses { accepted: 1 }") {
    const v1::DaemonStatus now = with(pinging + driver, poses, clock);
    const v1::DaemonStatus before = two_seconds_before(now);
    return trouble(judge(now, &before), "clock").text;
  };
  EXPECT_EQ(stands("lockstep"), "Time stands still at 41.600 s: it moves when control asks for a step");
  EXPECT_THAT(stands("follow"), HasSubstr("stamps of the poses"));
  EXPECT_EQ(stands("follow", ""), "Waiting for the first pose: time follows the poses");
  EXPECT_THAT(stands("stepped"), HasSubstr("when the last ping is computed and taken"));
  v1::DaemonStatus before = two_seconds_before(with(pinging + driver, "", "stepped"));
  before.set_now_ns(1);
  EXPECT_THAT(troubles(judge(with(pinging + driver, "", "stepped"), &before)), IsEmpty());
}

TEST(Judge, AnActiveFaultIsTheFirstLine) {
  const std::string thin = R"( do: "thin-tether" sonar: "front" state: "active" expires_s: 20 } )";
  const std::string faults = R"(faults { name: "thin-tether.1" code: "L13" )" + thin +
                             R"(faults { name: "thin-tether.2" code: "L14" )" + thin +
                             R"(faults { name: "later" do: "L05" code: "L05" state: "waiting" })";
  const std::vector<Finding> findings = judge(with(silent + "}", faults), nullptr);
  EXPECT_EQ(findings.front().check, "fault");
  EXPECT_EQ(findings.front().text, "A fault acts on front: thin-tether (L13, L14)");
  EXPECT_THAT(findings.front().cure, StartsWith("it ends by itself"));
  EXPECT_TRUE(
      std::is_sorted(findings.begin() + 1, findings.end(), [](const Finding& a, const Finding& b) { return a.level > b.level; }));
}

}  // namespace
}  // namespace sonar::doctor
