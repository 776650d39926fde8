// Tests the findings of doctor about the address of a sonar and about its clients, from given facts, without a network.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "clients/sonarctl/doctor/checks.hpp"
#include "tests/protocol/control/message_from.hpp"

namespace sonar::clients::doctor {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;
using Outcome = StreamFacts::Outcome;

/// Returns facts of one sonar that hosts reach over UDP, at a port of this computer.
Facts facts_by_udp(const std::string& host, Outcome outcome) {
  Facts facts;
  SonarFacts& sonar = facts.sonars.emplace_back();
  for (const protocol::Make& make : protocol::makes())
    if (make.ports.front().kind == protocol::HostPort::Kind::udp) sonar.make = &make;
  sonar.at = {host, sonar.make->ports.front().number};
  sonar.on_this_host = true;
  sonar.stream.outcome = outcome;
  sonar.stream.asked = true;
  sonar.stream.waited_s = 4;
  return facts;
}

void serve(Facts& facts, const std::string& sonar) {
  facts.control.at = {"127.0.0.1", 14770};
  facts.control.status = std::make_shared<v1::DaemonStatus>(
      control::message_from<v1::DaemonStatus>(R"(version: "1" clock: "realtime" sonars { name: "front" )" + sonar + "}"));
}

constexpr const char* there = R"(advertised: "127.0.0.2" addresses { protocol: "status" address: "127.255.255.255:9"
  sonar_speaks_first: true } addresses { protocol: "udp" address: "127.0.0.2:7777" } )";

TEST(DoctorPlaces, AWrongUdpAddressNamesWhatIsServedElsewhere) {
  Facts facts = facts_by_udp("127.0.0.9", Outcome::refused);
  EXPECT_THAT(text_from(run_checks(facts)), AllOf(HasSubstr("fail  udp 127.0.0.9:"), HasSubstr(": no program listens there"),
                                                  HasSubstr("start it: sonard"), Not(HasSubstr("tcp"))));
  serve(facts, there);
  EXPECT_THAT(text_from(run_checks(facts)), AllOf(HasSubstr("the sonard at 127.0.0.1:14770 serves front at udp 127.0.0.2:7777"),
                                                  HasSubstr("that sonard does not serve 127.0.0.9; it serves front at udp "
                                                            "127.0.0.2:7777"),
                                                  Not(HasSubstr("start it"))));
  facts.daemons = {{"127.0.0.2:7777", 12, "sonard"}};
  EXPECT_THAT(text_from(run_checks(facts)), HasSubstr("sonard (pid 12) listens on 127.0.0.2:7777: sonarctl doctor"));
}

TEST(DoctorPlaces, ListsWhatEachAddressOfASonarCarries) {
  Facts facts = facts_by_udp("127.0.0.2", Outcome::pings);
  serve(facts, R"(advertised: "127.0.0.2" addresses { protocol: "status" address: "127.255.255.255:9" sonar_speaks_first: true
    carries: "state" } addresses { protocol: "udp" address: "127.0.0.2:7777" carries: "settings, lines" })");
  const std::string all = "status 127.255.255.255:9 (state), udp 127.0.0.2:7777 (settings, lines)";
  EXPECT_THAT(text_from(run_checks(facts)), HasSubstr("ok    front: " + all + "\n"));
  for (const Outcome outcome : {Outcome::refused, Outcome::unreachable}) {
    facts.sonars[0].stream.outcome = outcome;
    EXPECT_THAT(text_from(run_checks(facts)), AllOf(HasSubstr("fail  "), Not(HasSubstr("ok    front")))) << "not there";
  }
  facts.sonars[0].stream.outcome = Outcome::refused;
  EXPECT_THAT(text_from(run_checks(facts)), AllOf(HasSubstr("the sonard at 127.0.0.1:14770 serves it at " + all +
                                                            ": use one of these ports; if it is one, sonarctl fault list"),
                                                  Not(HasSubstr("start it"))));
  facts.sonars[0].stream.outcome = Outcome::pings;
  serve(facts, there);
  EXPECT_THAT(text_from(run_checks(facts)), HasSubstr("ok    front: status 127.255.255.255:9, udp 127.0.0.2:7777\n"))
      << "an older daemon";
}

TEST(DoctorPlaces, ForASilentUdpAddressAFirewallIsSuggested) {
  Facts facts = facts_by_udp("127.0.0.2", Outcome::unreachable);
  facts.sonars[0].stream.error = "no answer";
  EXPECT_THAT(text_from(run_checks(facts)), HasSubstr("a firewall on this computer may drop udp "));
}

TEST(DoctorPlaces, AHostThatBeganAtTheSameTimeIsNamed) {
  Facts facts = facts_by_udp("127.0.0.2", Outcome::no_ping);
  serve(facts, there);
  facts.sonars[0].stream.own = "127.0.0.1:50001";
  const auto report = [&](const std::string& clients) {
    facts.sonars[0].reported = std::make_shared<v1::SonarStatus>(control::message_from<v1::SonarStatus>(clients));
    return text_from(run_checks(facts));
  };
  EXPECT_THAT(report(R"(clients { address: "127.0.0.1:50001" pings_written: 4 })"), HasSubstr("overloaded"));
  EXPECT_THAT(
      report(R"(clients { address: "127.0.0.1:50001" } clients { address: "127.0.0.1:50002" pings_written: 4 })"),
      AllOf(HasSubstr("127.0.0.1:50002 sent it requests at the same time, and gets its pings"), Not(HasSubstr("overloaded"))));
}

}  // namespace
}  // namespace sonar::clients::doctor
