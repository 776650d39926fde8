// The findings of doctor for every state, without a network: facts in, lines out.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "clients/sonarctl/doctor/checks.hpp"
#include "clients/sonarctl/doctor/proc_net.hpp"
#include "clients/sonarctl/ping_stream.hpp"
#include "tests/protocol/control/message_from.hpp"

namespace sonar::clients::doctor {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using Outcome = StreamFacts::Outcome;

ReceivedStatus received(const std::string& from) {
  ReceivedStatus status;
  status.from = status.advertised = from;
  status.device_id = 7001;
  status.size = 142;
  return status;
}

SonarFacts healthy_sonar(const std::string& host) {
  SonarFacts sonar;
  sonar.at = {host, 52100};
  sonar.on_this_host = true;
  StreamFacts& s = sonar.stream;
  s.outcome = Outcome::pings;
  s.asked = true;
  s.first_ping_ms = 96.4, s.beams = 512, s.rows = 437, s.bits = 8;
  s.pings = 15, s.asked_hz = 10, s.rate_hz = 9.98;
  s.latency_p50_ms = 18.2, s.latency_p99_ms = 21.4;
  return sonar;
}

std::shared_ptr<const v1::DaemonStatus> daemon_of(const std::string& host) {
  return std::make_shared<v1::DaemonStatus>(control::message_from<v1::DaemonStatus>(
      R"(version: "0.1.0" clock: "realtime" engine: "embree, avx2" vehicles { name: "rov" source: "demo orbit" }
         sonars { name: "front" status_to: "192.0.2.255:52102" rate_hz: 10 listens: ")" +
      host + R"(:52100" advertised: ")" + host + R"(" })"));
}
/// Returns the status of the daemon, which a test may change.
v1::DaemonStatus& daemon_in(Facts& facts) {
  const auto copy = std::make_shared<v1::DaemonStatus>(*facts.control.status);
  facts.control.status = copy;
  return *copy;
}
/// Makes the daemon report the first sonar and returns that report, which a test may change.
v1::SonarStatus& report(Facts& facts) {
  const auto reported = std::make_shared<v1::SonarStatus>(facts.control.status->sonars(0));
  facts.sonars[0].reported = reported;
  return *reported;
}

Facts healthy() {
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

/// Returns the line of that check; empty if there is none or more than one.
Finding line(const std::vector<Finding>& findings, const std::string& check) {
  std::vector<Finding> found;
  for (const Finding& f : findings)
    if (f.check == check) found.push_back(f);
  EXPECT_EQ(found.size(), 1u) << check << " in\n" << text_from(findings);
  return found.size() == 1 ? found.front() : Finding{};
}
Finding line(const Facts& facts, const std::string& check) { return line(run_checks(facts), check); }

void expect(const Finding& finding, Level level, const std::string& text, const std::string& cure) {
  EXPECT_EQ(finding.level, level) << finding.text;
  EXPECT_THAT(finding.text, HasSubstr(text));
  if (cure.empty())
    EXPECT_THAT(finding.cure, IsEmpty());
  else
    EXPECT_THAT(finding.cure, HasSubstr(cure));
}

TEST(Doctor, ColoursLevelsForATerminal) {
  const std::vector<Finding> found{
      {Level::ok, "a", "well", ""}, {Level::warn, "b", "doubtful", ""}, {Level::fail, "c", "bad", "mend it"}};
  const std::string text = text_from(found, true);
  EXPECT_THAT(text, HasSubstr("\x1b[32mok    \x1b[0mwell\n\x1b[33mwarn  \x1b[0mdoubtful\n\x1b[31mfail  \x1b[0mbad; mend it\n"));
  EXPECT_THAT(text_from(found), testing::Not(HasSubstr("\x1b")));
}

TEST(Doctor, PraisesWhatIsWell) {
  EXPECT_EQ(
      text_from(run_checks(healthy())),
      "ok    status broadcast received back on udp 52102 from 127.0.0.2\n"
      "ok    tcp 127.0.0.2:52100 accepts, first ping decoded after 96 ms: 512 beams x 437 ranges, 8 bit, size fields consistent\n"
      "ok    rate 10.0 Hz (asked 10), image latency 18 ms p50, 21 ms p99\n"
      "ok    control tcp 127.0.0.1:14770 answers: sonard 0.1.0, 1 sonar, realtime clock\n"
      "ok    trace backend: embree, avx2\n"
      "ok    poses of rov: demo orbit\n"
      "ok    http://127.0.0.1:8088/healthz returns ok\n"
      "ok    ports 52100,52102 are reserved\n"
      "8 checks, 0 errors, 0 warnings\n");
  EXPECT_FALSE(any_failed(run_checks(healthy())));
}

TEST(Doctor, WarnsOfPortsThatOthersMayTake) {
  Facts facts = healthy();
  facts.kernel_ports.reserved = "";
  EXPECT_THAT(text_from(run_checks(facts)),
              HasSubstr("warn  ports 52100,52102 lie in the ephemeral range 32768-60999: an outgoing "
                        "connection may occupy one before sonard starts; to reserve them: sysctl "
                        "net.ipv4.ip_local_reserved_ports=52100,52102\n8 checks, 0 errors, 1 warning\n"));
  facts.kernel_ports.reserved = "8080,52101-52110";
  expect(line(facts, "ports"), Level::warn, "port 52100 lies", "ip_local_reserved_ports=8080,52101-52110,52100");
  facts.kernel_ports = {true, 10000, 50000, ""};
  expect(line(facts, "ports"), Level::ok, "outside the ephemeral range 10000-50000", "");
  facts.kernel_ports.known = false;
  EXPECT_THAT(text_from(run_checks(facts)), Not(HasSubstr("ephemeral")));
}

Facts facts_of(const char* make, const std::string& host) {
  Facts facts;
  facts.sonars.push_back(healthy_sonar(host));
  SonarFacts& sonar = facts.sonars.front();
  for (const protocol::Make& one : protocol::makes())
    if (one.name() == make) sonar.make = &one;
  EXPECT_EQ(sonar.make->name(), make);
  sonar.at.port = sonar.make->ports.front().number;
  sonar.on_this_host = false;
  return facts;
}

TEST(Doctor, NamesWhatOtherNetworksDoNotPass) {
  const auto behind_a_router = [](const char* make) {
    Facts facts = facts_of(make, "192.0.2.7");
    facts.sonars[0].in_our_network = false;
    return facts;
  };
  expect(line(behind_a_router("oculus"), "network"), Level::warn,
         "192.0.2.7 is in another network: broadcasts and multicasts may not pass (its status to udp 52102)",
         "name the driver's computer in status_to");
  expect(line(behind_a_router("aris"), "network"), Level::warn, "(its status to udp 56124)", "status_to");
  expect(line(behind_a_router("waterlinked"), "network"), Level::warn, "(pings to 224.0.0.96:4747)",
         "its own address instead of the group");
  expect(line(behind_a_router("blueview"), "network"), Level::warn, "(searches at udp 14751)",
         "give the driver the address 192.0.2.7");
  expect(line(behind_a_router("ping360"), "network"), Level::warn, "(searches at udp 30303)", "the address 192.0.2.7");
  for (const char* of_unicast : {"surveyor240", "omniscan450", "ping1d", "s500", "dvl", "m3", "micron", "norbit"})
    EXPECT_THAT(text_from(run_checks(behind_a_router(of_unicast))), Not(HasSubstr("another network")));
  Facts facts = behind_a_router("oculus");
  facts.status.received.push_back(received("192.0.2.7"));  // its messages do arrive
  EXPECT_THAT(text_from(run_checks(facts)), Not(HasSubstr("another network")));
}

TEST(Doctor, KnowsMachinesWhoseNetworkIsTheirOwn) {
  Facts facts = facts_of("oculus", "172.17.0.2");
  EXPECT_THAT(text_from(run_checks(facts)), Not(HasSubstr("may not pass")));
  facts.machine = Machine::wsl2;
  expect(line(facts, "network"), Level::ok, "172.17.0.2 is reached via this WSL2 machine", "status_to");
  facts.status.received.push_back(received("172.17.0.2"));  // on this computer
  facts.machine = Machine::container;
  expect(line(facts, "network"), Level::ok, "by way of this container", "status_to");
  facts.sonars[0].at.host = "127.0.0.2";  // for drivers here
  EXPECT_THAT(text_from(run_checks(facts)), Not(HasSubstr("may not pass")));
}

TEST(Doctor, KnowsWhyNoStatusComes) {
  Facts facts = healthy();
  facts.status.received.clear();
  expect(line(facts, "status"), Level::fail, "no status from 127.0.0.2 on udp 52102 within 2.5 s",
         "a firewall may drop udp 52102");
  report(facts);
  expect(line(facts, "status"), Level::fail, "no status", "it is sent to 192.0.2.255:52102");
  facts.status.error = "Address already in use";
  facts.status.holders = {{"0.0.0.0:52102", 4711, "oculus_node"}};
  expect(line(facts, "status"), Level::warn,
         "cannot listen on udp 52102, held without address reuse by oculus_node (pid 4711): Address already in use",
         "stop that program");
  facts.status.holders[0].pid = 0;
  expect(line(facts, "status"), Level::warn, "by a program of another user", "stop that program");
}

TEST(Doctor, SaysWhatDriversWouldObjectToInTheStatus) {
  Facts facts = healthy();
  facts.status.received[0].complaints = {"datagram length 140 is not a status message's 142"};
  expect(line(facts, "status"), Level::fail, "datagram length 140", "is it a sonar?");
}

TEST(Doctor, FollowsTheAdvertisedAddress) {
  Facts facts = healthy();
  facts.status.received[0].from = "127.0.0.1";
  expect(line(facts, "status"), Level::ok, "from 127.0.0.1, which directs drivers to 127.0.0.2", "");
  facts.status.received[0] = received("127.0.0.2");
  facts.status.received[0].advertised = "10.1.1.1";
  expect(line(facts, "status"), Level::fail, "directs drivers to 10.1.1.1, where no sonar answers", "advertise_ip");
}

TEST(Doctor, LeavesABusySonarAlone) {
  Facts facts = healthy();
  facts.sonars[0].stream = {};
  facts.sonars[0].clients = {"127.0.0.1:41022"};
  expect(line(facts, "ping"), Level::ok, "127.0.0.2 is busy: 127.0.0.1:41022 is connected; not connecting (--take", "");
  v1::SonarFigures& figures = *report(facts).mutable_figures();
  figures.set_served(120);
  figures.set_latency_ms_p99(33);
  expect(line(facts, "ping"), Level::ok, "it reports 120 pings served, 0 dropped, latency 0 ms p50, 33 ms p99", "");
  EXPECT_FALSE(any_failed(run_checks(facts)));
}

TEST(Doctor, SaysWhereSomethingDoesListen) {
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

TEST(Doctor, NamesWhoElseHasThePort) {
  Facts facts = healthy();
  SonarFacts& sonar = facts.sonars[0];
  sonar.stream = {};
  sonar.stream.outcome = Outcome::no_ping;
  sonar.stream.waited_s = 4;
  sonar.listeners = {{"0.0.0.0:52100", 99, "nginx"}};
  expect(line(facts, "ping"), Level::fail, "no ping came within 4.0 s: nginx (pid 99) has the port, not sonard", "stop it");
  sonar.stream.junk_bytes = 300;
  expect(line(facts, "ping"), Level::fail,
         "sends 300 bytes that are not messages of an Oculus: nginx (pid 99) listens on 0.0.0.0:52100",
         "another program has the port");
}

TEST(Doctor, KnowsWhyNoPingComes) {
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
  expect(line(facts, "rate"), Level::warn, "rate 6.2 Hz (asked 10)", "engine.threads");
  s.rate_hz = 10, s.missing = 4;
  expect(line(facts, "rate"), Level::warn, "4 pings missing", "outbox");
  s.missing = 0, s.latency_p50_ms.reset(), s.spread_p99_ms = 7.0;
  expect(line(facts, "rate"), Level::ok, "images come 7 ms later than the earliest, p99", "");
  v1::SonarFigures& figures = *report(facts).mutable_figures();
  figures.set_latency_ms_p50(25);
  figures.set_latency_ms_p99(31);
  expect(line(facts, "rate"), Level::ok, "image latency 25 ms p50, 31 ms p99", "");
  s.asked = false, s.rate_hz = 3;
  expect(line(facts, "rate"), Level::warn, "rate 3.0 Hz (asked 10)", "fewer beams");
  s.pings = 1;
  expect(line(facts, "rate"), Level::warn, "one ping only", "sonarctl listen 127.0.0.2");
}

TEST(Doctor, SaysWhatComputingAllows) {
  Facts facts = healthy();
  SonarFacts& sonar = facts.sonars[0];
  sonar.stream.computing_ms = 12;
  EXPECT_THAT(line(facts, "rate").text, Not(HasSubstr("computing"))) << "as fast as an Oculus can be asked for";
  sonar.stream.computing_ms = 52;
  expect(line(facts, "rate"), Level::ok, "rate 10.0 Hz (asked 10)", "");
  expect(line(facts, "rate"), Level::ok, ", computing takes 52 ms per ping: 19 Hz at most here", "");
  sonar.stream.computing_ms = 193, sonar.stream.rate_hz = 5.2;
  expect(line(facts, "rate"), Level::warn, "computing takes 193 ms per ping: 5.2 Hz at most here: the simulation is slower",
         "engine.threads");

  // A sonar with another client, by the statistics of the daemon.
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

TEST(Doctor, ExpectsControlWhereADaemonIs) {
  Facts facts = healthy();
  facts.control.status.reset();
  facts.control.error = "no answer";
  expect(line(facts, "control"), Level::warn, "no answer", "poses, clients and engine were not checked");
  facts.control.given = true;
  expect(line(facts, "control"), Level::fail, "no answer", "poses, clients and engine were not checked");
  facts.control.token_required = true;
  expect(line(facts, "control"), Level::warn, "127.0.0.1:14770 requires a token, and none was given", "--token-file FILE");
  facts.control.token_required = false;
  facts.control.given = false;
  facts.sonars[0].on_this_host = false;
  EXPECT_THAT(text_from(run_checks(facts)), Not(HasSubstr("control"))) << "a device of another computer";
  facts.control.status = daemon_of("127.0.0.77");
  EXPECT_THAT(text_from(run_checks(facts)), HasSubstr("warn  that sonard does not serve 127.0.0.2"));
}

TEST(Doctor, KnowsThatARecordingHasItsOwnRateAndNoControl) {
  Facts facts = healthy();
  facts.control.status.reset();
  facts.control.error = "no answer";
  facts.http.text = "ok: replays run.mcap";
  facts.sonars[0].stream.rate_hz = 5;
  expect(line(facts, "rate"), Level::ok, "rate 5.0 Hz (asked 10)", "");
  EXPECT_THAT(text_from(run_checks(facts)), AllOf(HasSubstr(", as in the recording\n"), Not(HasSubstr("no answer"))));
}

TEST(Doctor, SaysWhatTheDaemonNotedAndNotThatAllIsWellWithThoseVehicles) {
  Facts facts = healthy();
  daemon_in(facts).MergeFrom(control::message_from<v1::DaemonStatus>(
      R"(vehicles { name: "boat" source: "initial pose" }
         notes { vehicle: "boat" text: "mavlink udpin:127.0.0.1:14551: no poses yet" cure: "see the streams" }
         notes { text: "wreck is long" cure: "scale" })"));
  const std::string text = text_from(run_checks(facts));
  EXPECT_THAT(text, HasSubstr("warn  mavlink udpin:127.0.0.1:14551: no poses yet; see the streams\n"));
  EXPECT_THAT(text, HasSubstr("warn  wreck is long; scale\n"));
  EXPECT_THAT(text, Not(HasSubstr("poses of boat")));
  EXPECT_THAT(text, HasSubstr("ok    poses of rov: demo orbit\n"));
  EXPECT_FALSE(any_failed(run_checks(facts)));
}

TEST(Doctor, LooksAtPosesHttpAndClocks) {
  Facts facts = healthy();
  v1::DaemonStatus& status = daemon_in(facts);
  status.mutable_vehicles(0)->set_source("json 127.0.0.1");
  status.mutable_vehicles(0)->set_stale(true);
  expect(line(facts, "poses"), Level::warn, "poses of rov have stopped, the last came from json 127.0.0.1", "on_stale");
  status.mutable_vehicles(0)->set_stale(false);
  status.mutable_poses()->set_refused(3);
  EXPECT_THAT(text_from(run_checks(facts)), HasSubstr("warn  3 messages were refused as poses, 0 accepted"));
  facts.http.code = 0;
  expect(line(facts, "http"), Level::warn, "does not answer", "--http");
  facts.http.code = 503, facts.http.text = "no ping for 5 s";
  expect(line(facts, "http"), Level::fail, "answers 503: no ping for 5 s", "log");
  facts.http.code = 401;
  expect(line(facts, "http"), Level::warn, "answers 401", "token");
  facts.http.place = HttpFacts::Place::not_served;
  expect(line(facts, "http"), Level::ok, "HTTP is not served", "");
  facts.http.place = HttpFacts::Place::only_over_there;
  expect(line(facts, "http"), Level::ok, "http://127.0.0.1:8088/healthz accepts only clients on that computer", "");
  facts.control.clock_ahead_s = -3.5;
  expect(line(facts, "clock"), Level::warn, "3.50 s behind this one", "NTP");
  facts.control.clock_ahead_s = 0.01;
  expect(line(facts, "clock"), Level::ok, "0.01 s ahead of this one", "");
}

TEST(Doctor, ChecksEverySonarAndTellsThemApart) {
  Facts facts = healthy();
  facts.sonars.push_back(healthy_sonar("127.0.0.3"));
  facts.sonars[0].name = "front";
  facts.status.received.push_back(received("127.0.0.3"));
  const std::string text = text_from(run_checks(facts));
  EXPECT_THAT(text, HasSubstr("ok    front: tcp 127.0.0.2:52100 accepts"));
  EXPECT_THAT(text, HasSubstr("ok    127.0.0.3: tcp 127.0.0.3:52100 accepts"));
  expect(line(facts, "identity"), Level::warn, "127.0.0.2 and 127.0.0.3 have the same device id, 7001", "device_id");
  facts.sonars[1].out_of_time = true;
  EXPECT_THAT(text_from(run_checks(facts)),
              HasSubstr("warn  127.0.0.3: 127.0.0.3 was not examined: the time limit was reached; raise it with --within"));
}

TEST(Doctor, ASonarByHttpThatSendsNothingIsAnErrorWhenAHostSetItUp) {
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

TEST(Doctor, FindsBlueViewHeads) {
  Facts facts = healthy();
  daemon_in(facts).MergeFrom(control::message_from<v1::DaemonStatus>(
      R"(sonars { name: "bow" profile: "blueview-p900-90" listens: "127.0.0.4:14750" advertised: "127.0.0.4" rate_hz: 10 })"));
  expect(line(facts, "blueview"), Level::warn, "bow at 127.0.0.4:14750, a BlueView sonar, does not answer discovery on udp 14751",
         "udp 14751");
  facts.address_given = true;  // 127.0.0.2: the other address was not checked
  EXPECT_THAT(text_from(run_checks(facts)), Not(HasSubstr("does not answer discovery")));
  facts.found = {{find_make("blueview"), "127.0.0.4:14750", "BlueView head P900-90 (123)"}};
  expect(line(facts, "blueview"), Level::ok, "BlueView head P900-90 (123) answers discovery at tcp 127.0.0.4:14750", "");
}

/// A BlueView head that pings, and the daemon's report of it.
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

TEST(Doctor, LooksAtAHeadAsItsHostsDo) {
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

TEST(Doctor, SaysWhatIsWrongWithAHead) {
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
  expect(line(facts, "ping"), Level::fail, "refuses the connection", "sonard --help");
}

TEST(Doctor, ChecksThePortsOfTheSonarsThatAreThere) {
  Facts facts = healthy();
  facts.sonars[0].at.port = 62312, facts.sonars[0].make = make_at(62312);
  facts.kernel_ports = {true, 32768, 65000, ""};
  expect(line(facts, "ports"), Level::warn, "port 62312 lies", "ip_local_reserved_ports=62312");
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

TEST(Doctor, OnlyWarnsOfAClientTurnedAwayFromPlacesThatAreUsedWell) {
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

TEST(Doctor, WaitsForTheFirstPingAsLongAsItTakes) {
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

TEST(Doctor, PrintsWhatTheSonarAnswered) {
  Facts facts = healthy();
  StreamFacts& s = facts.sonars[0].stream;
  s = {};
  s.outcome = Outcome::no_ping;
  s.refuses = true;
  s.error = "tcp 127.0.0.2:62312 refused a request: wrong range";
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

TEST(Doctor, SpeaksJson) {
  Facts facts = healthy();
  facts.kernel_ports.reserved = "";
  const std::string json = json_from(run_checks(facts));
  EXPECT_THAT(json, AllOf(HasSubstr("\"checks\":8"), HasSubstr("\"errors\":0"), HasSubstr("\"warnings\":1"),
                          HasSubstr("\"check\":\"ports\""), HasSubstr("\"level\":\"warn\"")));
}

TEST(ProcNet, ReadsSocketsAsTheKernelPrintsThem) {
  const auto sockets = parse_proc_net(
      "  sl  local_address rem_address   st tx_queue rx_queue tr tm->when retrnsmt   uid  timeout inode\n"
      "   0: 0200007F:CB84 00000000:0000 0A 00000000:00000000 00:00000000 00000000     0        0 4242 1 0 100 0\n"
      "   1: 0200007F:CB84 0100007F:A03E 01 00000000:00000000 02:00000000 00000000     0        0 4243 1 0 100 0\n"
      "garbage\n"
      "   2: 00000000000000000000000000000000:CB86 00000000000000000000000000000000:0000 07 0:0 00:0 0 0 0 77\n"
      "   3: 0000000000000000FFFF00000500007F:CB86 00000000000000000000000000000000:0000 07 0:0 00:0 0 0 0 78\n"
      "   4: 0200007F:CB84\n");
  ASSERT_EQ(sockets.size(), 4u);
  EXPECT_EQ(sockets[0].local_host, "127.0.0.2");
  EXPECT_EQ(sockets[0].local_port, 52100);
  EXPECT_EQ(sockets[0].state, listening);
  EXPECT_EQ(sockets[0].inode, 4242u);
  EXPECT_EQ(sockets[1].remote_host, "127.0.0.1");
  EXPECT_EQ(sockets[1].state, established);
  EXPECT_EQ(sockets[2].local_host, "[::]");
  EXPECT_EQ(sockets[3].local_host, "127.0.0.5");
  const PortHolder holder = holder_of(sockets[0], {{4242, {12, "sonard"}}});
  EXPECT_EQ(holder.at, "127.0.0.2:52100");
  EXPECT_EQ(holder.program, "sonard");
  EXPECT_EQ(holder_of(sockets[1], {}).pid, 0);
}

}  // namespace
}  // namespace sonar::clients::doctor
