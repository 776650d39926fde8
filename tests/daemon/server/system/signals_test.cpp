// Tests which signals of a user or a terminal end the daemon gracefully, and which must not end it.
#include <gmock/gmock.h>
#include <unistd.h>

#include <csignal>

#include "tests/daemon/server/loopback.hpp"

namespace sonar::testing_daemon {
namespace {

using oculus::PingRate;
using ::testing::HasSubstr;
using ::testing::Not;

DaemonSetup with_signals() {
  DaemonSetup setup;
  setup.options.handle_signals = true;
  return setup;
}
bool logs(Daemon& daemon, const std::string& words) {
  return eventually([&] { return daemon.log_text().find(words) != std::string::npos; });
}

TEST(Signals, HangupIsLoggedAndClientsStayConnected) {
  Daemon daemon(with_signals());
  Client client(daemon.address());
  client.fire(fire_at(PingRate::hz40));
  ASSERT_TRUE(client.next_ping());
  ASSERT_EQ(kill(getpid(), SIGHUP), 0);
  ASSERT_TRUE(logs(daemon, "reload: there is no configuration file; nothing changed"));
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(client.next_ping());
  EXPECT_THAT(daemon.log_text(), Not(HasSubstr("stopping")));
  EXPECT_EQ(daemon.stop(), 0);
}

TEST(Signals, TerminateStillEndsGracefullyAfterAHangup) {
  Daemon daemon(with_signals());
  Client client(daemon.address());
  client.fire(fire_at(PingRate::hz10));
  ASSERT_TRUE(client.next_ping());
  ASSERT_EQ(kill(getpid(), SIGHUP), 0);
  ASSERT_TRUE(logs(daemon, "reload:"));
  ASSERT_EQ(kill(getpid(), SIGTERM), 0);
  EXPECT_TRUE(client.read_to_end()) << "a FIN, not a reset";
  EXPECT_EQ(daemon.wait(), 0);
  EXPECT_THAT(daemon.log_text(), HasSubstr("stopping: terminated"));
}

TEST(Signals, AHangupTogetherWithATerminationDoesNotPreventTheStop) {
  Daemon daemon(with_signals());
  daemon.on_io_thread([] {  // both signals arrive before either is handled
    ASSERT_EQ(raise(SIGTERM), 0);
    ASSERT_EQ(raise(SIGHUP), 0);
  });
  const auto begin = Steady::now();
  EXPECT_EQ(daemon.wait(), 0);
  EXPECT_LT(Steady::now() - begin, App::stop_limit) << "without clients, the stop waits for nothing";
  EXPECT_THAT(daemon.log_text(), Not(HasSubstr("reload:")));
}

TEST(Signals, TerminateDoesNotWaitForALongPing) {
  std::promise<void> begun, let_go;
  DaemonSetup setup = with_signals();
  setup.engine_before = [&, once = let_go.get_future().share()](std::uint32_t) {
    begun.set_value();
    once.wait();
  };
  Daemon daemon(setup);
  Client client(daemon.address());
  client.fire(fire_at(PingRate::hz10));
  ASSERT_EQ(begun.get_future().wait_for(patience), std::future_status::ready);
  ASSERT_EQ(kill(getpid(), SIGTERM), 0);
  EXPECT_TRUE(client.read_to_end()) << "a FIN, not a reset";
  client.close();
  EXPECT_EQ(daemon.wait(), 0) << "run() returns while the ping is being computed";
  let_go.set_value();
}

}  // namespace
}  // namespace sonar::testing_daemon
