// Tests messages to a service manager, which a socket of the test replaces: sonard must report that it is ready, reloads and
// stops, and send watchdog messages only while the simulation thread makes progress.
#include "daemon/server/system/notify.hpp"

#include <gmock/gmock.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>

#include "tests/daemon/server/loopback.hpp"

namespace sonar::testing_daemon {
namespace {

using oculus::PingRate;
using std::chrono::microseconds;
using ::testing::HasSubstr;
using ::testing::StartsWith;

/// The manager's end of the socket. `name` is a path, or @ and a name in the abstract namespace.
class Manager {
 public:
  explicit Manager(const std::string& name) : name_(name) {
    fd_ = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    sockaddr_un at{};
    at.sun_family = AF_UNIX;
    std::copy(name.begin(), name.end(), at.sun_path);
    if (name[0] == '@') at.sun_path[0] = '\0';
    const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + name.size());
    EXPECT_EQ(::bind(fd_, static_cast<const sockaddr*>(static_cast<const void*>(&at)), size), 0);
    wait_at_most(patience);
  }
  ~Manager() {
    ::close(fd_);
    std::error_code ec;
    if (name_[0] != '@') std::filesystem::remove(name_, ec);
  }
  /// Returns the next message; empty if none arrived in time.
  std::string next() {
    std::string text(4096, '\0');
    const auto size = ::recv(fd_, text.data(), text.size(), 0);
    text.resize(size > 0 ? static_cast<std::size_t>(size) : 0);
    return text;
  }
  std::string next_except_watchdog() {
    std::string text = next();
    while (text == "WATCHDOG=1") text = next();
    return text;
  }
  void wait_at_most(milliseconds time) const {
    const timeval patience{time.count() / 1000, 1000 * (time.count() % 1000)};
    ::setsockopt(fd_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  }

 private:
  std::string name_;
  int fd_ = -1;
};

std::string own_name(char first) {
  static int count = 0;
  const std::string name = "sonard-notify-" + std::to_string(getpid()) + "-" + std::to_string(++count);
  return first == '@' ? "@" + name : ::testing::TempDir() + "/" + name;
}

class NotifyAt : public ::testing::TestWithParam<char> {};

TEST_P(NotifyAt, ReportsReadinessAfterOpeningListenersAndTheEnd) {
  const std::string name = own_name(GetParam());
  Manager manager(name);
  DaemonSetup setup;
  setup.options.service_manager = {name, {}};
  Daemon daemon(setup);
  EXPECT_THAT(manager.next(), StartsWith("READY=1\nSTATUS=Serving front on " + daemon.address()));
  Client client(daemon.address());  // connects at once, because the listener is open
  EXPECT_EQ(daemon.stop(), 0);
  EXPECT_THAT(manager.next(), StartsWith("STOPPING=1"));
}
INSTANTIATE_TEST_SUITE_P(PathAndAbstract, NotifyAt, ::testing::Values('/', '@'));

TEST(Notify, WatchdogMessagesComeWithoutClientsAndWhilePingsAreQuick) {
  const std::string name = own_name('@');
  Manager manager(name);
  DaemonSetup setup;
  setup.options.service_manager = {name, milliseconds(200)};
  Daemon daemon(setup);
  EXPECT_THAT(manager.next(), StartsWith("READY=1"));
  for (int i = 0; i < 3; ++i) EXPECT_EQ(manager.next(), "WATCHDOG=1");
  Client client(daemon.address());
  client.fire(fire_at(PingRate::hz40));
  ASSERT_TRUE(client.next_ping());
  for (int i = 0; i < 3; ++i) EXPECT_EQ(manager.next(), "WATCHDOG=1");
  EXPECT_EQ(daemon.stop(), 0);
  EXPECT_THAT(manager.next_except_watchdog(), StartsWith("STOPPING=1"));
}

TEST(Notify, APingThatDoesNotEndStopsTheWatchdogMessages) {
  const std::string name = own_name('@');
  Manager manager(name);
  std::atomic<bool> held{true};
  DaemonSetup setup;
  setup.options.service_manager = {name, milliseconds(200)};
  setup.engine_before = [&held](std::uint32_t) {
    while (held) std::this_thread::sleep_for(milliseconds(5));
  };
  Daemon daemon(setup);
  EXPECT_THAT(manager.next(), StartsWith("READY=1"));
  Client client(daemon.address());
  client.fire(fire_at(PingRate::hz10));
  EXPECT_TRUE(eventually([&] { return daemon.log_text().find("no sign of life") != std::string::npos; }));
  manager.wait_at_most(milliseconds(600));  // three periods; earlier messages are read first
  int signs = 0;
  while (!manager.next().empty() && signs < 1000) ++signs;
  EXPECT_LT(signs, 1000) << "watchdog messages do not end";
  held = false;
  manager.wait_at_most(patience);
  EXPECT_EQ(manager.next(), "WATCHDOG=1");
  EXPECT_EQ(daemon.stop(), 0);
}

TEST(Notify, AReloadIsAnnouncedAndEndsWithReadiness) {
  const std::string name = own_name('@');
  Manager manager(name);
  asio::io_context io;
  Log log;
  Notify notify(
      io, {name, {}}, [] { return std::chrono::nanoseconds{0}; }, log);
  notify.reloading();
  EXPECT_THAT(manager.next(), ::testing::AllOf(StartsWith("RELOADING=1\n"), HasSubstr("MONOTONIC_USEC=")));
  notify.ready("two\nlines");
  EXPECT_EQ(manager.next(), "READY=1\nSTATUS=two lines");
  notify.stopping();
  notify.stopping();
  EXPECT_THAT(manager.next(), StartsWith("STOPPING=1"));
  manager.wait_at_most(milliseconds(50));
  EXPECT_EQ(manager.next(), "") << "the message is not repeated";
}

TEST(Notify, AMissingManagerIsReportedOnceAndHasNoEffect) {
  DaemonSetup setup;
  setup.options.service_manager = {own_name('@'), milliseconds(20)};
  Daemon daemon(setup);
  Client client(daemon.address());
  client.fire(fire_at(PingRate::hz40));
  for (int i = 0; i < 8; ++i) ASSERT_TRUE(client.next_ping());
  EXPECT_EQ(daemon.stop(), 0);
  const std::string text = daemon.log_text();
  const std::size_t first = text.find("cannot notify the service manager");
  ASSERT_NE(first, std::string::npos);
  EXPECT_EQ(text.find("cannot notify the service manager", first + 1), std::string::npos);
}

TEST(Notify, WrongSocketNamesAreRefused) {
  for (const std::string& name : {std::string("relative/path"), std::string(200, '/')}) {
    std::string logged;
    asio::io_context io;
    Log log({LogLevel::info, false, [&logged](LogLevel, const std::string& line) { logged += line; }});
    Notify notify(
        io, {name, {}}, [] { return std::chrono::nanoseconds{0}; }, log);
    notify.ready("x");
    EXPECT_THAT(logged, HasSubstr("not the address of a local socket"));
  }
}

TEST(Notify, TheEnvironmentNamesTheSocketAndTheWatchdogOfThisProcessOnly) {
  ::setenv("NOTIFY_SOCKET", "@somewhere", 1);
  ::setenv("WATCHDOG_USEC", "3000000", 1);
  ::unsetenv("WATCHDOG_PID");
  EXPECT_EQ(notify_target_from_environment().socket, "@somewhere");
  EXPECT_EQ(notify_target_from_environment().watchdog, microseconds(3000000));
  ::setenv("WATCHDOG_PID", std::to_string(getpid()).c_str(), 1);
  EXPECT_EQ(notify_target_from_environment().watchdog, microseconds(3000000));
  ::setenv("WATCHDOG_PID", "1", 1);
  EXPECT_EQ(notify_target_from_environment().watchdog, microseconds(0));
  ::unsetenv("WATCHDOG_PID");
  for (const char* wrong : {"", "-5", "soon", "99999999999999999999"}) {
    ::setenv("WATCHDOG_USEC", wrong, 1);
    EXPECT_EQ(notify_target_from_environment().watchdog, microseconds(0)) << wrong;
  }
  for (const char* name : {"NOTIFY_SOCKET", "WATCHDOG_USEC", "WATCHDOG_PID"}) ::unsetenv(name);
  EXPECT_EQ(notify_target_from_environment().socket, "");
}

}  // namespace
}  // namespace sonar::testing_daemon
