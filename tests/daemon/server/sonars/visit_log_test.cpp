// Tests that a client that reconnects endlessly causes only a few log lines, which count all of its connections.
#include "daemon/server/sonars/visit_log.hpp"

#include <gmock/gmock.h>

#include "protocol/control/answers.hpp"
#include "tests/daemon/server/loopback.hpp"

namespace sonar::testing_daemon::visit_log_test {
namespace {

using Kind = VisitLog::Kind;
using ::testing::HasSubstr;
using ::testing::SizeIs;

struct Bench {
  asio::io_context io;
  std::vector<std::string> lines;
  Log log{{.sink = [this](LogLevel, const std::string& line) { lines.push_back(line); }}};
  VisitLog visits{io, log, "front", milliseconds(50)};
  void come_and_go(int times) {
    for (int i = 0; i < times; ++i) {
      visits.say(Kind::connected, "client connected", {});
      visits.say(Kind::gone, "client gone: closed by the client", {});
    }
  }
};

TEST(VisitLog, FewVisitsAreLoggedOneByOne) {
  Bench bench;
  bench.come_and_go(4);
  bench.io.run();  // the series of visits ends
  EXPECT_THAT(bench.lines, SizeIs(8));
  bench.come_and_go(4);
  bench.visits.end();
  EXPECT_THAT(bench.lines, SizeIs(16)) << "a new period has its own lines";
}

TEST(VisitLog, ManyVisitsAreSummedUpAndAllAreCounted) {
  Bench bench;
  bench.come_and_go(10);
  ASSERT_THAT(bench.lines, SizeIs(VisitLog::lines_a_spell));
  bench.io.run_one();
  ASSERT_THAT(bench.lines, SizeIs(VisitLog::lines_a_spell + 1));
  EXPECT_THAT(bench.lines.back(), HasSubstr("clients connect and leave often"));
  EXPECT_THAT(bench.lines.back(), HasSubstr("connected=6  gone=6  refused=0"));
  EXPECT_THAT(bench.lines.back(), HasSubstr("closed by the client"));
  bench.come_and_go(3);
  bench.io.run_one();
  EXPECT_THAT(bench.lines, SizeIs(VisitLog::lines_a_spell + 2)) << "a crowded period is followed by one summary";
  EXPECT_THAT(bench.lines.back(), HasSubstr("connected=3  gone=3"));
  bench.io.run();
  bench.come_and_go(1);
  EXPECT_THAT(bench.lines, SizeIs(VisitLog::lines_a_spell + 4)) << "then visits are logged singly again";
  bench.visits.end();
}

TEST(VisitLog, TheEndReportsTheRemainingVisits) {
  Bench bench;
  bench.come_and_go(10);
  bench.visits.end();
  EXPECT_THAT(bench.lines.back(), HasSubstr("connected=6  gone=6"));
  bench.visits.say(Kind::gone, "client gone: sonard stops", {});
  EXPECT_THAT(bench.lines.back(), HasSubstr("sonard stops")) << "clients disconnected after end() are logged";
  EXPECT_EQ(bench.io.run(), 1u) << "only the cancelled timer is left";
}

TEST(VisitLog, AReconnectingClientIsLoggedAsGone) {
  Daemon daemon;
  for (int i = 0; i < 12; ++i) {
    const auto clients = [&] { return daemon.status().sonars().at(0).clients().size(); };
    Client client(daemon.address());
    ASSERT_TRUE(eventually([&] { return clients() == 1; }));
    client.close();
    ASSERT_TRUE(eventually([&] { return clients() == 0; }));
  }
  daemon.stop();
  int gone = 0;
  std::istringstream lines(daemon.log_text());
  for (std::string line; std::getline(lines, line);) {
    if (line.find("client gone: closed by the client") != std::string::npos &&
        line.find("connect and leave") == std::string::npos)
      ++gone;
    if (const auto at = line.find(" gone="); at != std::string::npos) gone += std::stoi(line.substr(at + 6));
  }
  EXPECT_EQ(gone, 12) << daemon.log_text();
}

}  // namespace
}  // namespace sonar::testing_daemon::visit_log_test
