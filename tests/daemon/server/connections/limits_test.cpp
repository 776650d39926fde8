// Limits for untrusted clients: slots of the whole daemon, bytes per second, and counts of pings that balance in any case.
#include <gmock/gmock.h>

#include <fcntl.h>
#include <sys/resource.h>
#include <unistd.h>

#include "daemon/server/connections/admission.hpp"
#include "daemon/server/system/real_time.hpp"
#include "tests/daemon/server/loopback.hpp"

namespace sonar::testing_daemon {
namespace {

using oculus::PingRate;
using ::testing::HasSubstr;

std::size_t count(const std::string& text, const std::string& what) {
  std::size_t found = 0;
  for (auto at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++found;
  return found;
}

TEST(Limits, SlotsOfTheDaemonIncludeWaitingClients) {
  DaemonSetup setup;
  setup.sonar_lines = "    clients: {max: 1, when_full: queue}\n";
  setup.more = "limits: {clients: 2}\n";
  Daemon daemon(setup);
  auto served = std::make_unique<Client>(daemon.address());
  served->fire(fire_at(PingRate::hz40));
  ASSERT_TRUE(served->next_ping());
  Client waits(daemon.address());
  ASSERT_TRUE(eventually([&] { return daemon.log_text().find("client waits for a slot") != std::string::npos; }));
  for (int i = 0; i < 3; ++i) {
    Client newcomer(daemon.address());
    EXPECT_TRUE(newcomer.read_to_end());
    EXPECT_EQ(newcomer.bytes_read, 0u);
  }
  EXPECT_EQ(count(daemon.log_text(), "no connection slot free"), 1u) << "logged once";
  ASSERT_TRUE(served->next_ping());
  served->close();
  waits.fire(fire_at(PingRate::hz40));
  EXPECT_TRUE(waits.next_ping());
  Client queued(daemon.address());
  EXPECT_FALSE(queued.next(milliseconds(200)));
  EXPECT_FALSE(queued.ended) << "the slot of the client that left is free";
  daemon.stop();
  EXPECT_EQ(daemon.figures().refused_clients, 3u);
}

TEST(Limits, AClientThatSendsTooMuchIsReadSlowlyAndLosesNothing) {
  DaemonSetup setup;
  setup.sonar_lines = "    clients: {max: 2}\n";
  setup.more = "limits: {input_bytes_per_s: 8192}\n";
  Daemon daemon(setup);
  Client talks(daemon.address()), neighbour(daemon.address());
  neighbour.fire(fire_at(PingRate::hz2, 2));  // slow enough that a busy computer loses no ping
  ASSERT_TRUE(neighbour.next_ping());
  const auto begin = Steady::now();
  talks.send(std::string(40000, 'x'));  // bytes for 5 s; those of one second are allowed at once
  talks.fire(fire_at(PingRate::hz10, 3));
  oculus::PingSequence ids;
  while (true) {
    const auto ping = neighbour.next_ping();
    ASSERT_TRUE(ping);
    EXPECT_THAT(ids.add(*ping), ::testing::IsEmpty());
    if (ping->head.fixed.fire.range == 3) break;
    ASSERT_LT(Steady::now() - begin, 3 * patience);
  }
  EXPECT_GT(Steady::now() - begin, milliseconds(2000));
  EXPECT_EQ(ids.skipped_ids(), 0u) << "the other client loses no ping";
}

TEST(Limits, RequestsOfASonarsClientCountAsMoreThanTheirBytes) {
  DaemonSetup setup;
  setup.more = "limits: {input_bytes_per_s: 65536}\n";
  Daemon daemon(setup);
  Client talks(daemon.address());
  const auto begin = Steady::now();
  for (int i = 0; i < 900; ++i) talks.fire(fire_at(PingRate::hz10, 2));  // only slightly more bytes than are allowed at once
  talks.fire(fire_at(PingRate::hz10, 3));
  while (true) {
    const auto ping = talks.next_ping();
    ASSERT_TRUE(ping);
    if (ping->head.fixed.fire.range == 3) break;
    ASSERT_LT(Steady::now() - begin, 3 * patience);
  }
  EXPECT_GT(Steady::now() - begin, milliseconds(2000));
}

TEST(Limits, AccountsBalanceWhateverClientsDo) {
  DaemonSetup setup;
  setup.sonar_lines = "    clients: {max: 3}\n";
  Daemon daemon(setup);
  Client stays(daemon.address());
  Client never_reads(daemon.address(), 52100, 16384);
  auto fire = fire_at(PingRate::hz40, 4);
  fire.settings.flags |= oculus::flag::beams_512;
  stays.fire(fire);
  for (int i = 0; i < 10; ++i) {
    Client leaves(daemon.address());
    ASSERT_TRUE(leaves.next());
    ASSERT_TRUE(stays.next_ping());
    i % 2 == 0 ? leaves.reset() : leaves.close();
  }
  never_reads.reset();
  std::thread reader([&] { EXPECT_TRUE(stays.read_to_end()); });
  EXPECT_EQ(daemon.stop(), 0);
  reader.join();
  const DeviceFigures f = daemon.figures();
  EXPECT_LE(f.pings + f.skipped_ticks, f.ticks);
  EXPECT_LE(f.ticks, f.pings + f.skipped_ticks + 1) << "a ping may be under way at the stop";
  EXPECT_EQ(f.waiting, 0u);
  EXPECT_GT(f.sent, 0u);
  EXPECT_EQ(f.offered, f.sent + f.dropped);
  EXPECT_EQ(f.latency.count(), f.sent);
  EXPECT_EQ(f.simulation.count(), f.pings);
  EXPECT_GE(f.bytes_written, stays.bytes_read);
}

TEST(Limits, TheLastDescriptorsAreNotForClients) {
  rlimit was{};
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &was), 0);
  const int next = ::open("/dev/null", O_RDONLY);  // the number that the next socket would have
  ::close(next);
  rlimit low = was;
  low.rlim_cur = static_cast<rlim_t>(next) + 40;
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &low), 0);
  LimitConfig limits;
  limits.spare_descriptors = 30;
  std::string said;
  LogOptions options;
  options.sink = [&](LogLevel, const std::string& line) { said += line; };
  Log log(options);
  Admission admission(limits, log);
  asio::io_context io;
  std::vector<tcp::socket> sockets;
  std::vector<Admission::Place> places;
  int refused = 0;
  for (int i = 0; i < 25; ++i) {
    sockets.emplace_back(io, tcp::v4());
    places.push_back(admission.enter(sockets.back()));
    refused += places.back() ? 0 : 1;
  }
  EXPECT_GE(refused, 10);
  EXPECT_LT(refused, 25);
  EXPECT_EQ(admission.now() + static_cast<std::uint64_t>(refused), 25u);
  EXPECT_EQ(admission.refused_for_descriptors(), static_cast<std::uint64_t>(refused));
  EXPECT_EQ(count(said, "file descriptors run out"), 1u);
  places.clear();
  EXPECT_EQ(admission.now(), 0u);
  setrlimit(RLIMIT_NOFILE, &was);
}

TEST(Limits, MoreSpareDescriptorsThanHalfOfAllAreReportedAtTheStart) {
  rlimit was{};
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &was), 0);
  rlimit low = was;
  low.rlim_cur = 200;
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &low), 0);
  LimitConfig limits;
  std::string said;
  LogOptions options;
  options.sink = [&](LogLevel, const std::string& line) { said += line; };
  Log log(options);
  limits.spare_descriptors = 100;
  const Admission half(limits, log);
  EXPECT_EQ(said, "");
  limits.spare_descriptors = 101;
  const Admission more(limits, log);
  EXPECT_THAT(said, testing::HasSubstr("limits.spare_descriptors is more than half of this process's descriptors: lower it"));
  EXPECT_THAT(said, testing::HasSubstr("100"));
  setrlimit(RLIMIT_NOFILE, &was);
}

asio::awaitable<void> let_in(Admission& admission, tcp::acceptor& acceptor, Admission::Purpose purpose,
                             std::vector<tcp::socket>& in) {
  while (auto socket = co_await admission.next_visitor(acceptor, purpose)) in.push_back(*std::move(socket));
}

TEST(Limits, TheLastDescriptorsAreNotForPosesAndHalfOfThemForControl) {
  LimitConfig limits;
  limits.spare_descriptors = 30;
  std::string said;
  LogOptions options;
  options.sink = [&](LogLevel, const std::string& line) { said += line; };
  Log log(options);
  Admission admission(limits, log);
  asio::io_context io;
  rlimit was{};
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &was), 0);
  const auto visited = [&](Admission::Purpose purpose) {
    tcp::acceptor acceptor(io, {asio::ip::make_address("127.0.0.2"), 0});
    std::vector<tcp::socket> in, visitors;
    asio::co_spawn(io, let_in(admission, acceptor, purpose, in), asio::detached);
    const int next = ::open("/dev/null", O_RDONLY);
    ::close(next);
    rlimit low = was;
    low.rlim_cur = static_cast<rlim_t>(next) + 40;
    EXPECT_EQ(setrlimit(RLIMIT_NOFILE, &low), 0);
    for (int i = 0; i < 20; ++i) {  // each connection needs two descriptors of this process
      visitors.emplace_back(io);
      visitors.back().connect(acceptor.local_endpoint());
      io.restart();
      io.poll();
    }
    setrlimit(RLIMIT_NOFILE, &was);
    acceptor.close();
    io.restart();
    io.run();
    return in.size();
  };
  const std::size_t poses = visited(Admission::Purpose::client), control = visited(Admission::Purpose::control);
  EXPECT_GT(poses, 0u);
  EXPECT_LE(poses, 10u);
  EXPECT_GT(control, poses);
  EXPECT_LE(control, 14u);
  EXPECT_EQ(admission.refused_for_descriptors(), 40 - poses - control);
  EXPECT_EQ(count(said, "file descriptors run out"), 1u);
}

TEST(Threads, ComputingThreadsAndTheirChildrenHaveLowPriority) {
  int own = 0, started = 0;
  const auto niceness = [] { return getpriority(PRIO_PROCESS, static_cast<id_t>(gettid())); };
  const int here = niceness();
  compute_apart([&] {
    own = niceness();
    std::thread([&] { started = niceness(); }).join();
  });
  EXPECT_EQ(own, std::min(here + background_niceness, 19));
  EXPECT_EQ(started, own);
  EXPECT_EQ(niceness(), here);
  EXPECT_THROW(compute_apart([] { throw std::runtime_error("no"); }), std::runtime_error);
}

TEST(Threads, GetTheNicenessOfTheMainThreadAtTheEnd) {
  const int first = getpriority(PRIO_PROCESS, static_cast<id_t>(getpid()));
  const auto own = [] { return static_cast<id_t>(gettid()); };
  bool permitted = false;
  compute_apart([&] { permitted = setpriority(PRIO_PROCESS, own(), first) == 0; });
  compute_apart([&] {
    const int before = getpriority(PRIO_PROCESS, own());
    hurry_all_threads();
    EXPECT_EQ(getpriority(PRIO_PROCESS, own()), permitted ? first : before);
  });
}

TEST(Threads, RealTimeIsUsedOrTheWarningSaysWhatToDo) {
  std::thread([] {  // a separate thread, so that the test's own is not changed
    const std::string why = schedule_in_real_time(1);
    if (why.empty()) {
      EXPECT_EQ(sched_getscheduler(0) & ~SCHED_RESET_ON_FORK, SCHED_FIFO);
      std::thread([] { EXPECT_EQ(sched_getscheduler(0), SCHED_OTHER); }).join();
    } else {
      EXPECT_THAT(why, HasSubstr("LimitRTPRIO=1"));
      EXPECT_THAT(why, HasSubstr("setcap cap_sys_nice+ep"));
    }
  })
      .join();
}

}  // namespace
}  // namespace sonar::testing_daemon
