// Thousands of clients connect and disconnect in many ways, including a reset. Afterwards the daemon is as before.
#include <algorithm>
#include <memory>
#include <vector>

#include "daemon/server/control/prometheus.hpp"
#include "tests/load/load_case.hpp"
#include "tests/load/load_daemon.hpp"

namespace sonar::load {
namespace {

using std::chrono::milliseconds;

/// Connects until one whole ping has been read, because a slot may not be free yet.
bool is_served(const std::string& address) {
  return eventually([&] {
    PingReader reader(Socket(address, 52100));
    if (reader.socket().fd() < 0 || !reader.socket().send(fire(40))) return false;
    const auto until = Steady::now() + milliseconds(500);
    while (reader.pings == 0 && reader.read_some() && Steady::now() < until) {
      timespec pause{0, 1'000'000};
      nanosleep(&pause, nullptr);
    }
    return reader.pings > 0 && reader.garbled == 0;
  });
}

void leave(Socket& socket, int way) {
  switch (way % 4) {
    case 0:
      return socket.close();
    case 1:
      return socket.reset();
    case 2:
      socket.close_one_way();
      return socket.close();
    default: {  // in the middle of a request
      auto cut = fire(40);
      cut.resize(cut.size() / 2);
      socket.send(cut);
      socket.close();
    }
  }
}

TEST(Load, ShortConnectionsLeaveNoDescriptors) {
  const int cycles = quick ? 400 : 10000;
  LoadDaemon daemon({1, "    clients: {max: 16}\n", "limits: {input_bytes_per_s: 1073741824}\n"});
  const auto cycle = [&](int i) {
    Socket socket(daemon.address(), 52100);
    ASSERT_GE(socket.fd(), 0) << "cycle " << i;
    socket.send(fire(i % 3 == 0 ? 0 : 40));
    leave(socket, i);
    if (i % 100 == 99) {  // waits, so that connections are accepted as fast as they come
      ASSERT_TRUE(is_served(daemon.address())) << "cycle " << i;
    }
  };
  for (int i = 0; i < 200; ++i) cycle(i);
  const auto all_gone = [&](const ProcessFigures& was) {
    return eventually([&] { return figures_of_this_process().open_descriptors <= was.open_descriptors; });
  };
  const ProcessFigures idle = [&] {  // the minimum over one second, because the last visitors still disconnect
    ProcessFigures least = figures_of_this_process();
    eventually(
        [&] {
          const auto now = figures_of_this_process();
          least.open_descriptors = std::min(least.open_descriptors, now.open_descriptors);
          return false;
        },
        milliseconds(1000));
    least.resident_bytes = figures_of_this_process().resident_bytes;
    return least;
  }();
  for (int i = 0; i < cycles; ++i) cycle(i);
  EXPECT_TRUE(all_gone(idle));
  const ProcessFigures after = figures_of_this_process();
  const double grown_mib = (static_cast<double>(after.resident_bytes) - static_cast<double>(idle.resident_bytes)) / (1 << 20);
  EXPECT_EQ(after.open_descriptors, idle.open_descriptors);
  EXPECT_EQ(after.threads, idle.threads);
  if (memory_is_ours) {
    EXPECT_LE(grown_mib, quick ? 8.0 : 2.0);
  }
  EXPECT_TRUE(is_served(daemon.address()));
  daemon.stop();
  expect_accounts_balance(daemon.figures());
  const auto change = [](std::uint64_t now, std::uint64_t was) { return static_cast<long>(now) - static_cast<long>(was); };
  keep("cycles",
       format("%d cycles: descriptors %+ld, threads %+ld, memory %+.2f MiB", cycles,
              change(after.open_descriptors, idle.open_descriptors), change(after.threads, idle.threads), grown_mib),
       "back to baseline, memory within 2 MiB",
       after.open_descriptors == idle.open_descriptors && after.threads == idle.threads && grown_mib <= 2);
}

/// Clients connect, request pings, read one to three of them, and disconnect in several ways.
TEST(Load, ADriverReconnectsManyTimes) {
  const int times = quick ? 60 : 1000;
  LoadDaemon daemon({1, "", "limits: {input_bytes_per_s: 1073741824}\n"});  // one slot, as by default
  int served = 0, attempts = 0;
  std::chrono::duration<double> longest{0};
  std::uint64_t garbled = 0;
  for (int i = 0; i < times; ++i) {
    const auto begin = Steady::now();
    const bool good = eventually([&] {
      ++attempts;
      PingReader reader(Socket(daemon.address(), 52100));
      if (reader.socket().fd() < 0 || !reader.socket().send(fire(40))) return false;
      const auto wanted = static_cast<std::uint64_t>(1 + i % 3);
      while (reader.pings < wanted && reader.read_some() && Steady::now() < begin + patience) {
        timespec pause{0, 500'000};
        nanosleep(&pause, nullptr);
      }
      garbled += reader.garbled;
      const bool enough = reader.pings >= wanted;
      leave(reader.socket(), i / 3);
      return enough;
    });
    ASSERT_TRUE(good) << "reconnect " << i;
    served += good ? 1 : 0;
    longest = std::max(longest, std::chrono::duration<double>(Steady::now() - begin));
  }
  EXPECT_EQ(garbled, 0u);
  EXPECT_TRUE(is_served(daemon.address()));
  daemon.stop();
  expect_accounts_balance(daemon.figures());
  keep("reconnects", format("%d of %d, %.2f s at most; %d attempts", served, times, longest.count(), attempts),
       "every one served", served == times && garbled == 0);
}

/// One client is in the middle of a stream, one is in standby.
TEST(Load, DeadPeersFreeTheirSlots) {
  const double promised_s = quick ? 4 : 15;
  LoadDaemon daemon({2, "", quick ? "limits: {dead_peer_s: 4, stall_s: 3}\n" : ""});
  std::vector<std::unique_ptr<Socket>> clients;
  for (std::size_t s = 0; s < 2; ++s) {
    clients.push_back(std::make_unique<Socket>(daemon.address(s), 52100));
    ASSERT_TRUE(clients.back()->send(fire(s == 0 ? 40 : 0)));
    std::byte first{};
    ASSERT_EQ(clients.back()->receive(&first, 1, patience), 1);
  }
  for (const auto& c : clients) c->die();
  const auto begin = Steady::now();
  const auto gone = [&] {
    const std::string log = daemon.log_text();
    const auto first = log.find("client gone");
    return first != std::string::npos && log.find("client gone", first + 1) != std::string::npos;
  };
  EXPECT_TRUE(eventually(gone, patience * 3));
  const double took_s = std::chrono::duration<double>(Steady::now() - begin).count();
  EXPECT_LE(took_s, quick ? promised_s + 15 : promised_s);
  for (std::size_t s = 0; s < 2; ++s) EXPECT_TRUE(is_served(daemon.address(s)));
  daemon.stop();
  for (std::size_t s = 0; s < 2; ++s) expect_accounts_balance(daemon.figures(s));
  keep("dead-peer", format("%.1f s, one in a stream and one in standby", took_s), "within 15 s", took_s <= promised_s);
}

}  // namespace
}  // namespace sonar::load

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  for (int i = 1; i < argc; ++i) {
    if (std::string(argv[i]) != "--quick") {
      std::fprintf(stderr, "usage: load_test [--quick] [--gtest_filter=Load.NAME]\n");
      return 64;
    }
    sonar::load::quick = true;
  }
  return RUN_ALL_TESTS();
}
