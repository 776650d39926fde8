// Tests the findings of doctor on connections to a sonar, and on the pings that doctor and drivers get. Input is facts.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "clients/sonarctl/doctor/probes.hpp"
#include "clients/sonarctl/ping_stream.hpp"
#include "tests/clients/doctor_testing.hpp"

namespace sonar::clients::doctor {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;
using namespace tests;
using Outcome = StreamFacts::Outcome;

TEST(Doctor, LeavesABusySonarAlone) {
  Facts facts = healthy();
  facts.sonars[0].stream = {};
  facts.sonars[0].clients = {"127.0.0.1:41022"};
  expect(line(facts, "ping"), Level::ok, "127.0.0.2 is busy: 127.0.0.1:41022 is connected; not connecting (--take", "");
  facts.sonars[0].clients.push_back("127.0.0.1:41023");
  EXPECT_THAT(line(facts, "ping").text, HasSubstr("127.0.0.1:41022, 127.0.0.1:41023 are connected; not connecting"));
  facts.sonars[0].clients.pop_back();
  v1::SonarFigures& figures = *report(facts).mutable_figures();
  figures.set_served(120);
  figures.set_latency_ms_p99(33);
  expect(line(facts, "ping"), Level::ok, "it reports 120 pings served, 0 dropped, latency 0 ms p50, 33 ms p99", "");
  EXPECT_FALSE(any_failed(run_checks(facts)));
}

TEST(Doctor, NamesAnAddressThatListens) {
  Facts facts;
  facts.sonars.push_back({});
  facts.sonars[0].at = {"127.0.0.2", 52100};
  facts.sonars[0].on_this_host = true;
  facts.sonars[0].stream.outcome = Outcome::refused;
  expect(line(facts, "ping"), Level::fail, "tcp 127.0.0.2:52100 refuses the connection: no program listens there",
         "start it: sonard");
  facts.status.received.push_back(received("127.0.0.9"));
  expect(line(facts, "ping"), Level::fail, "refuses", "names a sonar at 127.0.0.9: sonarctl doctor 127.0.0.9");
  facts.daemons = {{"127.0.0.5:52100", 12, "sonard"}};
  expect(line(facts, "ping"), Level::fail, "refuses",
         "sonard (pid 12) listens on 127.0.0.5:52100: sonarctl doctor 127.0.0.5:52100");
  facts = {};
  facts.sonars.push_back({});
  facts.sonars[0].at = {"192.0.2.7", 52100};
  facts.sonars[0].stream.outcome = Outcome::unreachable;
  facts.sonars[0].stream.error = "Connection timed out";
  expect(line(facts, "ping"), Level::fail, "does not answer: Connection timed out", "ip addr add 192.0.2.7/24 dev eth0");
  facts.sonars[0].on_this_host = true;
  expect(line(facts, "ping"), Level::fail, "does not answer", "a firewall on this computer may drop tcp 52100");
}

TEST(Doctor, NamesAnotherProgramAtThePort) {
  Facts facts = healthy();
  SonarFacts& sonar = facts.sonars[0];
  sonar.stream = {};
  sonar.stream.outcome = Outcome::no_ping;
  sonar.stream.waited_s = 4;
  sonar.listeners = {{"0.0.0.0:52100", 99, "nginx"}};
  expect(line(facts, "ping"), Level::fail, "no ping came within 4.0 s: nginx (pid 99) has the port, not sonard", "stop it");
  sonar.stream.junk_bytes = 300;
  expect(line(facts, "ping"), Level::fail,
         "sends 300 bytes in place of messages of an Oculus: nginx (pid 99) listens on 0.0.0.0:52100",
         "another program has the port");
}

TEST(Doctor, NamesTheReasonWithoutPings) {
  Facts facts = healthy();
  SonarFacts& sonar = facts.sonars[0];
  sonar.stream = {};
  sonar.stream.outcome = Outcome::no_ping;
  expect(line(facts, "ping"), Level::fail, "no ping came", "standby");
  sonar.stream.asked = true;
  expect(line(facts, "ping"), Level::fail, "no ping came", "overloaded");
  daemon_in(facts).set_clock("lockstep");
  expect(line(facts, "ping"), Level::warn, "with clock: lockstep time stops until a client requests a step", "sonarctl step");
  daemon_in(facts).set_clock("follow");
  expect(line(facts, "ping"), Level::warn, "with clock: follow time stops until the next pose comes", "sender of poses");
  report(facts).mutable_figures()->set_refused(7);
  expect(line(facts, "ping"), Level::fail, "the engine refused 7 of them", "log");
  sonar.stream.outcome = Outcome::closed_without_a_byte;
  expect(line(facts, "ping"), Level::warn, "closed the connection without a byte", "clients.max");
}

TEST(Doctor, FailsBrokenPings) {
  Facts facts = healthy();
  facts.sonars[0].stream.broken = 2;
  facts.sonars[0].stream.first_complaint = "image_size is 5, not 6";
  expect(line(facts, "ping"), Level::fail, "2 of 15 pings broken: image_size is 5, not 6", "sonarctl listen");
  facts.sonars[0].stream.broken = 0;
  facts.sonars[0].stream.junk_bytes = 3;
  expect(line(facts, "ping"), Level::fail, "3 bytes between messages", "sonarctl listen");
}

TEST(Doctor, MeasuresTheRate) {
  Facts facts = healthy();
  StreamFacts& s = facts.sonars[0].stream;
  s.rate_hz = 6.2;
  expect(line(facts, "rate"), Level::warn, "rate 6.2 Hz (requested 10)", "engine.threads");
  s.rate_hz = 10, s.missing = 4;
  expect(line(facts, "rate"), Level::warn, "4 pings missing", "outbox");
  s.missing = 0, s.latency_p50_ms.reset(), s.spread_p99_ms = 7.0;
  expect(line(facts, "rate"), Level::ok, "images come 7 ms later than the earliest, p99", "");
  v1::SonarFigures& figures = *report(facts).mutable_figures();
  figures.set_latency_ms_p50(25);
  figures.set_latency_ms_p99(31);
  expect(line(facts, "rate"), Level::ok, "image latency 25 ms p50, 31 ms p99", "");
  s.asked = false, s.rate_hz = 3;
  expect(line(facts, "rate"), Level::warn, "rate 3.0 Hz (requested 10)", "fewer beams");
  s.pings = 1;
  expect(line(facts, "rate"), Level::warn, "one ping only", "sonarctl listen 127.0.0.2");
}

TEST(Doctor, CountsOneBeamAsOne) {
  Facts facts = healthy();
  facts.sonars[0].stream.beams = 1;
  EXPECT_THAT(line(facts, "ping").text, HasSubstr(": 1 beam x 437 ranges, 8 bit"));
}

TEST(Doctor, ReportsTheRateThatComputingAllows) {
  Facts facts = healthy();
  SonarFacts& sonar = facts.sonars[0];
  sonar.stream.computing_ms = 12;
  EXPECT_THAT(line(facts, "rate").text, Not(HasSubstr("computing"))) << "fast enough for the highest rate of an Oculus";
  sonar.stream.computing_ms = 52;
  expect(line(facts, "rate"), Level::ok, "rate 10.0 Hz (requested 10)", "");
  expect(line(facts, "rate"), Level::ok, ", computing takes 52 ms per ping: 19 Hz at most here", "");
  sonar.stream.computing_ms = 193, sonar.stream.rate_hz = 5.2;
  expect(line(facts, "rate"), Level::warn, "computing takes 193 ms per ping: 5.2 Hz at most here: the simulation is slower",
         "engine.threads");
  sonar.stream.computing_ms = 555, sonar.stream.rate_hz = 9.1;
  EXPECT_THAT(line(facts, "rate").text, Not(HasSubstr("at most here"))) << "the measured rate is higher";

  // For a sonar with another client, doctor uses the statistics of the daemon.
  sonar.stream = {};
  sonar.clients = {"127.0.0.1:41022"};
  v1::SonarStatus& reported = report(facts);
  reported.set_pinging(true);
  reported.set_rate_hz(40);
  reported.mutable_figures()->set_simulation_ms(24);
  EXPECT_THAT(text_from(run_checks(facts)), Not(HasSubstr("computing")));
  reported.mutable_figures()->set_simulation_ms(52);
  reported.mutable_figures()->set_skipped_ticks(77);
  expect(line(facts, "rate"), Level::warn,
         "rate 40 Hz requested by 127.0.0.1:41022, computing takes 52 ms per ping: 19 Hz at most here, 77 ticks skipped",
         "fewer beams");
}

TEST(Doctor, AnHttpSonarThatSendsNothingToItsHostIsAnError) {
  Facts facts = healthy();
  SonarFacts& sonar = facts.sonars[0];
  sonar.make = find_make("waterlinked");
  v1::SonarStatus& reported = *daemon_in(facts).mutable_sonars(0);
  reported.set_profile("waterlinked-3d15");
  reported.set_pinging(false);
  report(facts);
  expect(line(facts, "ping"), Level::warn, "no images are made", "post true to /acoustics/enabled");
  reported.set_asked_by("10.0.0.7");
  report(facts);
  expect(line(facts, "ping"), Level::fail, "no images are made, although 10.0.0.7 has set it up", "a mode to /udp");
}

/// Returns facts of a BlueView head that pings, and the daemon's report of it.
Facts healthy_head() {
  Facts facts = healthy();
  facts.status.received.clear();  // heads send no status
  SonarFacts& sonar = facts.sonars[0];
  sonar.at.port = 14750, sonar.make = make_at(14750);
  sonar.stream.rows = 315, sonar.stream.bits = 16, sonar.stream.asked_hz = 0;
  v1::SonarStatus& head = *daemon_in(facts).mutable_sonars(0);
  head.set_profile("blueview-p900-90");
  head.set_listens("127.0.0.2:14750");
  head.set_rate_hz(15);
  report(facts);
  facts.found = {{find_make("blueview"), "127.0.0.2:14750", "BlueView head BlueView P900-90 (7001)"}};
  facts.kernel_ports = {};
  return facts;
}

TEST(Doctor, ExaminesAHeadLikeItsHosts) {
  Facts facts = healthy_head();
  facts.sonars[0].stream.rate_hz = 14.9;
  EXPECT_EQ(text_from(run_checks(facts)),
            "ok    tcp 127.0.0.2:14750 accepts, first ping decoded after 96 ms: 512 beams x 315 ranges, 16 bit, size fields "
            "consistent\n"
            "ok    rate 14.9 Hz (at most 15), image latency 18 ms p50, 21 ms p99\n"
            "ok    control tcp 127.0.0.1:14770 answers: sonard 0.1.0, 1 sonar, realtime clock\n"
            "ok    trace backend: embree, avx2\n"
            "ok    poses of rov: demo orbit\n"
            "ok    http://127.0.0.1:8088/healthz returns ok\n"
            "ok    BlueView head BlueView P900-90 (7001) answers discovery at tcp 127.0.0.2:14750\n"
            "7 checks, 0 errors, 0 warnings\n");
  facts.sonars[0].stream.rate_hz = 6;
  expect(line(facts, "rate"), Level::warn, "rate 6.0 Hz (at most 15)", "engine.threads");
}

TEST(Doctor, ReportsFaultsOfAHead) {
  Facts facts = healthy_head();
  StreamFacts& s = facts.sonars[0].stream;
  s = {};
  s.outcome = Outcome::no_ping;
  s.error = "tcp 127.0.0.2:14750 is not a BVE1 link: a frame has another magic number";
  expect(line(facts, "ping"), Level::fail, s.error, "another program has the port");
  s.error.clear();
  s.outcome = Outcome::closed_without_a_byte;
  expect(line(facts, "ping"), Level::warn, "all its client slots are taken", "clients.max");
  s.outcome = Outcome::refused;
  expect(line(facts, "ping"), Level::fail, "refuses the connection",
         "serves it at 127.0.0.2:14750: use one of these ports; if it is one, sonarctl fault list");
}

TEST(Doctor, FailsWhileADriverGetsNoPing) {
  Facts facts = healthy();
  SonarFacts& sonar = facts.sonars[0];
  sonar.stream = {};
  sonar.clients = {"127.0.0.1:40122"};
  v1::DaemonStatus& status = daemon_in(facts);
  status.mutable_sonars(0)->MergeFrom(control::message_from<v1::SonarStatus>(
      R"(profile: "surveyor-240" transmits: true
         clients { address: "127.0.0.1:40122" connected_s: 5 bytes_read: 17 })"));
  report(facts);
  expect(line(facts, "driver"), Level::fail,
         "127.0.0.1:40122 is connected to front and has not asked for pings: it has sent 17 bytes, no valid request among them",
         "send set_ping_parameters (3023)");
  v1::ClientStatus& client = *status.mutable_sonars(0)->mutable_clients(0);
  client.set_requests(1);  // a client in standby
  status.mutable_sonars(0)->set_rate_hz(0);
  status.mutable_sonars(0)->set_asked_by("127.0.0.1:40122");
  report(facts);
  EXPECT_THAT(text_from(run_checks(facts)),
              AllOf(HasSubstr("warn  front is in standby"),
                    HasSubstr("fail  127.0.0.1:40122 is connected and gets no ping; ask for a rate above 0")));
  client.set_pings_written(3);
  status.mutable_sonars(0)->set_rate_hz(10);
  report(facts);
  EXPECT_FALSE(any_failed(run_checks(facts)));
}

TEST(Doctor, FailsWhileAnotherDriverGetsNoPing) {
  Facts facts = healthy();
  v1::SonarStatus& front = *daemon_in(facts).mutable_sonars(0);
  front.MergeFrom(control::message_from<v1::SonarStatus>(
      R"(profile: "oculus-m1200d" transmits: true clients { address: "127.0.0.1:40122" connected_s: 5 bytes_read: 17 })"));
  const auto last = std::make_shared<v1::DaemonStatus>(*facts.control.status);
  last->mutable_sonars(0)->MergeFrom(control::message_from<v1::SonarStatus>(
      R"(clients { address: "127.0.0.1:40300" connected_s: 2 requests: 1 } gone { address: "127.0.0.1:40300" why: "x" ago_s: 1 }
         turned_away { address: "127.0.0.1:40300" why: "no slot is free" ago_s: 1 })"));
  facts.control.latest = last;
  report(facts);
  facts.sonars[0].stream.own = "127.0.0.1:40300";
  for (const Outcome outcome : {Outcome::pings, Outcome::closed_without_a_byte, Outcome::no_ping}) {
    facts.sonars[0].stream.outcome = outcome;
    expect(line(facts, "driver"), Level::fail, "127.0.0.1:40122 is connected to front and has not asked for pings",
           "send a fire message");
    EXPECT_THAT(text_from(run_checks(facts)), Not(HasSubstr("40300")));
  }
  facts.sonars[0].stream.outcome = Outcome::pings;
  last->mutable_sonars(0)->mutable_clients(0)->set_requests(1);
  last->mutable_sonars(0)->mutable_clients(0)->set_pings_written(20);
  EXPECT_FALSE(any_failed(run_checks(facts)));
  EXPECT_THAT(text_from(run_checks(facts)), HasSubstr("8 checks, 0 errors"));
}

TEST(Doctor, ProposesARequestOnlyToDriversThatNeedOne) {
  Facts facts = healthy();
  facts.sonars[0].stream = {};
  facts.sonars[0].clients = {"127.0.0.1:40122"};
  daemon_in(facts).mutable_sonars(0)->MergeFrom(control::message_from<v1::SonarStatus>(
      R"(profile: "m3" transmits: true pinging: true clients { address: "127.0.0.1:40122" connected_s: 5 })"));
  report(facts);
  EXPECT_THAT(text_from(run_checks(facts)),
              AllOf(HasSubstr("127.0.0.1:40122 is connected and gets no ping; it need not ask: pings come to each driver"),
                    Not(HasSubstr("send nothing"))));
}

TEST(Doctor, WarnsOfAClientThatWasRefusedWhileAllSlotsWereInUse) {
  Facts facts = healthy();
  facts.sonars[0].stream = {};
  facts.sonars[0].clients = {"127.0.0.1:40122"};
  v1::SonarStatus& front = *daemon_in(facts).mutable_sonars(0);
  front.MergeFrom(control::message_from<v1::SonarStatus>(
      R"(profile: "oculus-m1200d" transmits: true pinging: true
         clients { address: "127.0.0.1:40122" connected_s: 5 requests: 1 pings_written: 9 }
         turned_away { address: "10.0.0.7:1" why: "no slot is free" utc_ns: 3723000000000 ago_s: 5 })"));
  report(facts);
  expect(line(facts, "places"), Level::warn, "10.0.0.7:1 was refused", "clients.max");
  EXPECT_FALSE(any_failed(run_checks(facts)));
  front.mutable_clients(0)->set_pings_written(0);
  front.mutable_clients(0)->set_requests(0);
  report(facts);
  expect(line(facts, "places"), Level::fail, "10.0.0.7:1 was refused", "clients.max");
}

TEST(Doctor, WaitsForASlowFirstPing) {
  Facts facts = healthy();
  facts.sonars[0].stream = {};
  facts.sonars[0].clients = {"127.0.0.1:40122"};
  v1::SonarStatus& front = *daemon_in(facts).mutable_sonars(0);
  front.MergeFrom(control::message_from<v1::SonarStatus>(
      R"(profile: "oculus-m1200d" transmits: true pinging: true figures { simulation_ms: 1500 }
         clients { address: "127.0.0.1:40122" connected_s: 3 requests: 1 })"));
  report(facts);
  EXPECT_FALSE(any_failed(run_checks(facts))) << "two periods and two pings take 3.2 s";
  front.mutable_clients(0)->set_connected_s(3.5);
  report(facts);
  expect(line(facts, "driver"), Level::fail, "127.0.0.1:40122 is connected and gets no ping", "sonarctl status");
}

TEST(Doctor, MeasuresTheLatencyAfterTheClockWasSet) {
  for (const double wall_ahead_s : {0.0, 7200.0, -10800.0}) {
    ControlFacts clocks;
    const auto status = std::make_shared<v1::DaemonStatus>();
    status->set_wall_ahead_s(wall_ahead_s);
    clocks.status = status;
    SonarFacts sonar;
    set_latency(sonar, {wall_ahead_s + 0.02, wall_ahead_s + 0.03, wall_ahead_s + 0.04}, clocks);
    EXPECT_NEAR(sonar.stream.latency_p50_ms.value_or(0), 30, 0.001);
    EXPECT_NEAR(clocks.clock_ahead_s.value_or(0), -0.02, 1e-6) << "the sonar is on another computer";
    status->set_wall_ahead_s(wall_ahead_s + 5);
    sonar.stream = {};
    set_latency(sonar, {wall_ahead_s + 0.02}, clocks);
    EXPECT_FALSE(sonar.stream.latency_p50_ms) << "the clocks differ";
  }
}

TEST(Doctor, PrintsWhatTheSonarAnswered) {
  Facts facts = healthy();
  StreamFacts& s = facts.sonars[0].stream;
  s = {};
  s.outcome = Outcome::no_ping;
  s.refuses = true;
  s.error = "a Surveyor refuses a request: wrong range";
  expect(line(facts, "ping"), Level::fail, s.error, "sonarctl status");
  EXPECT_THAT(text_from(run_checks(facts)), Not(HasSubstr("another program")));
}

TEST(Doctor, NamesAFaultWhereItsOwnConnectionGetsNoPing) {
  Facts facts = healthy();
  v1::DaemonStatus& daemon = daemon_in(facts);
  v1::FaultStatus& fault = *daemon.add_faults();
  fault.set_name("F01"), fault.set_code("F01"), fault.set_state("active"), fault.set_sonar(daemon.sonars(0).name());
  facts.sonars[0].reported = std::make_shared<v1::SonarStatus>(daemon.sonars(0));
  EXPECT_THAT(text_from(run_checks(facts)), Not(HasSubstr("A fault acts"))) << "it got pings";
  facts.sonars[0].stream = {};
  facts.sonars[0].stream.outcome = Outcome::no_ping;
  expect(line(facts, "fault"), Level::fail, "A fault acts on " + daemon.sonars(0).name() + ": F01", "sonarctl fault reset");
}

}  // namespace
}  // namespace sonar::clients::doctor
