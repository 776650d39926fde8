// Tests the findings of doctor on computers, networks, daemons and search, from given facts, without a network.
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

TEST(Doctor, ColoursLevelsForATerminal) {
  const std::vector<Finding> found{
      {Level::ok, "a", "well", ""}, {Level::warn, "b", "doubtful", ""}, {Level::fail, "c", "bad", "mend it"}};
  const std::string text = text_from(found, true);
  EXPECT_THAT(text, HasSubstr("\x1b[32mok    \x1b[0mwell\n\x1b[33mwarn  \x1b[0mdoubtful\n\x1b[31mfail  \x1b[0mbad; mend it\n"));
  EXPECT_THAT(text_from(found), testing::Not(HasSubstr("\x1b")));
}

TEST(Doctor, ReportsPassedChecks) {
  EXPECT_EQ(
      text_from(run_checks(healthy())),
      "ok    status broadcast received back on udp 52102 from 127.0.0.2\n"
      "ok    tcp 127.0.0.2:52100 accepts, first ping decoded after 96 ms: 512 beams x 437 ranges, 8 bit, size fields consistent\n"
      "ok    rate 10.0 Hz (requested 10), image latency 18 ms p50, 21 ms p99\n"
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

TEST(Doctor, RecognisesMachinesWithTheirOwnNetwork) {
  Facts facts = facts_of("oculus", "172.17.0.2");
  EXPECT_THAT(text_from(run_checks(facts)), Not(HasSubstr("may not pass")));
  facts.machine = Machine::wsl2;
  expect(line(facts, "network"), Level::ok, "172.17.0.2 is reached via this WSL2 machine", "status_to");
  facts.status.received.push_back(received("172.17.0.2"));  // on this computer
  facts.machine = Machine::container;
  expect(line(facts, "network"), Level::ok, "via this container", "status_to");
  facts.sonars[0].at.host = "127.0.0.2";  // for drivers here
  EXPECT_THAT(text_from(run_checks(facts)), Not(HasSubstr("may not pass")));
}

TEST(Doctor, NamesTheReasonWithoutStatus) {
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

TEST(Doctor, ReportsAStatusThatDriversRefuse) {
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

TEST(Doctor, ExpectsNoRateAndNoControlFromARecording) {
  Facts facts = healthy();
  facts.control.status.reset();
  facts.control.error = "no answer";
  facts.http.text = "ok: replays run.mcap";
  facts.sonars[0].stream.rate_hz = 5;
  expect(line(facts, "rate"), Level::ok, "rate 5.0 Hz (requested 10)", "");
  EXPECT_THAT(text_from(run_checks(facts)), AllOf(HasSubstr(", as in the recording\n"), Not(HasSubstr("no answer"))));
}

TEST(Doctor, PrintsNotesInsteadOfAPassedCheck) {
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

TEST(Doctor, ChecksPosesHttpAndClocks) {
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

TEST(Doctor, ChecksEverySonarAndNamesItInFindings) {
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

TEST(Doctor, ChecksThePortsOfTheSonarsThatAreThere) {
  Facts facts = healthy();
  facts.sonars[0].at.port = 62312, facts.sonars[0].make = make_at(62312);
  facts.kernel_ports = {true, 32768, 65000, ""};
  expect(line(facts, "ports"), Level::warn, "port 62312 lies", "ip_local_reserved_ports=62312");
}

TEST(Doctor, PrintsJson) {
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
      "   4: 000080FE000000000000000001000000:CB86 B80D012000000001000000000000EFBE:0050 01 0:0 00:0 0 0 0 79\n"
      "   5: 00000000000000000000000001000000:CB86 04030201080706050C0B0A09100F0E0D:0051 01 0:0 00:0 0 0 0 80\n"
      "   6: 0200007F:CB84\n");
  ASSERT_EQ(sockets.size(), 6u);
  EXPECT_EQ(sockets[0].local_host, "127.0.0.2");
  EXPECT_EQ(sockets[0].local_port, 52100);
  EXPECT_EQ(sockets[0].state, listening);
  EXPECT_EQ(sockets[0].inode, 4242u);
  EXPECT_EQ(sockets[1].remote_host, "127.0.0.1");
  EXPECT_EQ(sockets[1].state, established);
  EXPECT_EQ(sockets[2].local_host, "[::]");
  EXPECT_EQ(sockets[3].local_host, "127.0.0.5");
  EXPECT_EQ(sockets[4].local_host, "[fe80::1]");
  EXPECT_EQ(sockets[4].remote_host, "[2001:db8:100::beef:0]");
  EXPECT_EQ(sockets[5].local_host, "[::1]");
  EXPECT_EQ(sockets[5].remote_host, "[102:304:506:708:90a:b0c:d0e:f10]");
  const PortHolder holder = holder_of(sockets[0], {{4242, {12, "sonard"}}});
  EXPECT_EQ(holder.at, "127.0.0.2:52100");
  EXPECT_EQ(holder.program, "sonard");
  EXPECT_EQ(holder_of(sockets[1], {}).pid, 0);
}

}  // namespace
}  // namespace sonar::clients::doctor
