// Tests many streams at once, and streams beside clients that misbehave. Every loss is counted, and no message is damaged.
#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <thread>

#include "daemon/server/control/prometheus.hpp"
#include "tests/load/load_case.hpp"
#include "tests/load/load_daemon.hpp"

namespace sonar::load {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using Readers = std::vector<std::unique_ptr<PingReader>>;

const std::string dummies = "    options: {dummy_period_ms: 50}\n";

/// Connects and waits until the client is served; from then on it gets every ping.
std::unique_ptr<PingReader> connected(const std::string& address) {
  auto reader = std::make_unique<PingReader>(Socket(address, 52100));
  std::byte first{};
  EXPECT_TRUE(eventually([&] { return ::recv(reader->socket().fd(), &first, 1, MSG_PEEK | MSG_DONTWAIT) == 1; }));
  return reader;
}

/// Stops the daemon while its clients continue to read, as drivers do.
void stop(LoadDaemon& daemon, Readers& readers) {
  std::thread stopping([&daemon] { EXPECT_EQ(daemon.stop(), 0); });
  read_all(readers, Steady::now() + patience);
  stopping.join();
  for (const auto& r : readers) {
    EXPECT_TRUE(r->ended && !r->was_reset && !r->cut()) << "every stream ends with a whole message and FIN";
  }
}

TEST(Load, EightSonarsServeFourClientsEach) {
  const int sonars = quick ? 3 : 8, clients = quick ? 2 : 4;
  const auto lasts = quick ? seconds(3) : seconds(45), warm = quick ? seconds(1) : seconds(10);
  LoadDaemon daemon({sonars, "    clients: {max: 4}\n    outbox: {depth: 3}\n" + dummies, ""});
  Readers readers;
  for (int s = 0; s < sonars; ++s)
    for (int c = 0; c < clients; ++c) readers.push_back(connected(daemon.address(static_cast<std::size_t>(s))));
  for (int s = 0; s < sonars; ++s) ASSERT_TRUE(readers[static_cast<std::size_t>(s * clients)]->socket().send(fire(40)));
  const auto begin = Steady::now();
  read_all(readers, begin + warm);
  const auto before = figures_of_this_process();
  read_all(readers, begin + lasts);
  const auto after = figures_of_this_process();
  stop(daemon, readers);

  std::uint64_t produced = 0, sent = 0, dropped = 0, received = 0, garbled = 0, skipped = 0;
  for (std::size_t s = 0; s < static_cast<std::size_t>(sonars); ++s) {
    const DeviceFigures f = daemon.figures(s);
    expect_accounts_balance(f);
    const std::uint64_t of_sonar = (f.pings - f.refused - f.unwanted) * static_cast<std::uint64_t>(clients);
    EXPECT_EQ(of_sonar, f.offered) << "every ping was offered to every client";
    produced += of_sonar, sent += f.sent, dropped += f.dropped, skipped += f.skipped_ticks;
  }
  for (const auto& r : readers) received += r->pings, garbled += r->garbled;
  EXPECT_GT(produced, 0u);
  EXPECT_EQ(received, sent) << "clients have received all pings that are counted as sent";
  EXPECT_EQ(garbled, 0u);
  const double share = 100.0 * static_cast<double>(dropped) / static_cast<double>(produced);
  const double grown_mib = (static_cast<double>(after.resident_bytes) - static_cast<double>(before.resident_bytes)) / (1 << 20);
  if (!quick) {
    EXPECT_LE(share, 0.5);
  }
  if (memory_is_ours) {
    EXPECT_LE(grown_mib, quick ? 16.0 : 1.0);
  }
  keep("load-accounted", format("%lu made, %lu sent, %lu dropped; %lu ticks skipped", produced, sent, dropped, skipped),
       "exactly equal", produced == sent + dropped && received == sent);
  keep("load-garbled", format("%lu of %lu received", garbled, received), "0", garbled == 0);
  keep("load-dropped", format("%.3f %%", share), "at most 0.5 %", share <= 0.5);
  keep("load-memory", format("%+.2f MiB", grown_mib), "at most 1 MiB", grown_mib <= 1);
}

TEST(Load, AClientThatNeverReadsCostsNoPing) {
  const double stall_s = quick ? 1 : 10;
  LoadDaemon daemon({1, "    clients: {max: 4}\n    outbox: {depth: 3}\n" + dummies, format("limits: {stall_s: %g}\n", stall_s)});
  Readers readers;
  for (int c = 0; c < 3; ++c) readers.push_back(connected(daemon.address()));
  Socket stalled(daemon.address(), 52100, 16384);
  std::byte first{};
  ASSERT_EQ(stalled.receive(&first, 1, patience), 1);
  ASSERT_TRUE(readers.front()->socket().send(fire(40)));
  const auto begin = Steady::now();
  const auto is_reset = [&] { return daemon.log_text().find("read no byte for ") != std::string::npos; };
  while (!is_reset() && Steady::now() < begin + patience * 2) read_all(readers, Steady::now() + milliseconds(50));
  const double reset_s = std::chrono::duration<double>(Steady::now() - begin).count();
  EXPECT_TRUE(is_reset());
  read_all(readers, Steady::now() + seconds(1));
  stop(daemon, readers);

  const DeviceFigures f = daemon.figures();
  expect_accounts_balance(f);
  const std::uint64_t made = f.pings - f.refused - f.unwanted;
  std::uint64_t lost = 0, garbled = 0, received = 0;
  for (const auto& r : readers) {
    lost += made - r->pings;
    received += r->pings;
    garbled += r->garbled;
  }
  // Pings that were still waiting at the stop are counted as dropped by the stop.
  const std::uint64_t at_stop = f.dropped_by[static_cast<std::size_t>(DropReason::stop)];
  EXPECT_LE(lost, at_stop);
  EXPECT_EQ(garbled, 0u);
  EXPECT_GT(f.dropped_by[static_cast<std::size_t>(DropReason::slow)], 0u) << "pings for the stalled client";
  EXPECT_GT(f.dropped_by[static_cast<std::size_t>(DropReason::gone)], 0u)
      << "pings that waited when the stalled client was reset";
  EXPECT_GE(reset_s, stall_s);
  EXPECT_LE(reset_s, stall_s + 15) << "the kernel's buffers fill first";
  const std::uint64_t to_fourth = f.offered - 3 * made, sent_to_fourth = f.sent - received;
  keep("stall-neighbours", format("%lu of %lu", lost - std::min(lost, at_stop), 3 * made), "0", lost <= at_stop);
  keep("stall-reset", format("%.1f s after the first ping, its kernel buffers filled first", reset_s), "10 s without progress",
       reset_s >= stall_s && reset_s <= stall_s + 15);
  keep("stall-accounted", format("%lu made for it: %lu sent, %lu dropped", to_fourth, sent_to_fourth, to_fourth - sent_to_fourth),
       "exactly equal", f.offered == f.sent + f.dropped);
}

/// Sends arbitrary bytes to every port, as fast as they are received.
class Junk {
 public:
  explicit Junk(const LoadDaemon& daemon) : daemon_(daemon) {
    std::uint32_t state = 7;
    for (std::byte& b : noise_) b = static_cast<std::byte>((state = state * 1664525u + 1013904223u) >> 24);
    const auto real = fire(0);
    for (std::size_t i = 0; i < noise_.size(); i += 4096)  // some bytes look like a message with a wrong length
      std::copy(real.begin(), real.begin() + 12, noise_.begin() + static_cast<std::ptrdiff_t>(i));
  }
  ~Junk() {
    if (udp_ >= 0) ::close(udp_);
  }

  void until(Steady::time_point end) {
    udp_ = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    std::array<std::unique_ptr<Socket>, 5> streams;
    const std::array<std::uint16_t, 5> ports{52100, 52100, 14770, 14771, 8088};
    while (Steady::now() < end) {
      for (std::size_t i = 0; i < streams.size(); ++i) send_stream(streams[i], ports[i]);
      for (int i = 0; i < 64; ++i) send_datagram(static_cast<std::uint16_t>(14770 + i % 2));
    }
  }
  std::uint64_t bytes() const { return bytes_; }

 private:
  void send_stream(std::unique_ptr<Socket>& stream, std::uint16_t port) {
    if (!stream || stream->fd() < 0) stream = std::make_unique<Socket>(daemon_.address(0), port);
    const auto n = ::send(stream->fd(), noise_.data(), noise_.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    if (n > 0) bytes_ += static_cast<std::uint64_t>(n);
    if (n < 0 && errno != EAGAIN) stream.reset();
  }
  void send_datagram(std::uint16_t port) {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(port);
    inet_pton(AF_INET, daemon_.pose_address().c_str(), &to.sin_addr);
    const auto n = ::sendto(udp_, noise_.data() + bytes_ % 4096, 1200, MSG_DONTWAIT,
                            static_cast<const sockaddr*>(static_cast<const void*>(&to)), sizeof to);
    if (n > 0) bytes_ += static_cast<std::uint64_t>(n);
  }

  const LoadDaemon& daemon_;
  std::array<std::byte, 65536> noise_{};
  int udp_ = -1;
  std::uint64_t bytes_ = 0;
};

TEST(Load, JunkCostsNoPing) {
  const auto lasts = quick ? seconds(3) : seconds(30);
  LoadDaemon daemon({2, "    clients: {max: 4}\n    outbox: {depth: 3}\n" + dummies, ""});
  Readers readers;
  readers.push_back(connected(daemon.address(1)));
  ASSERT_TRUE(readers.front()->socket().send(fire(40)));
  const auto begin = Steady::now();
  Junk junk(daemon);
  std::thread sending([&] { junk.until(begin + lasts); });
  read_all(readers, begin + lasts);
  sending.join();
  const auto stretch = Steady::now() - begin;
  stop(daemon, readers);
  const auto read_for_s = static_cast<std::uint64_t>(std::chrono::ceil<seconds>(Steady::now() - begin).count());

  const DeviceFigures f = daemon.figures(1), target = daemon.figures(0);
  expect_accounts_balance(f);
  expect_accounts_balance(target);
  const PingReader& neighbour = *readers.front();
  const double gap_ms = 1e3 * neighbour.longest_gap.count();
  const double due = 40 * std::chrono::duration<double>(stretch).count();
  EXPECT_EQ(neighbour.garbled, 0u);
  EXPECT_EQ(neighbour.ids_skipped, 0u);
  EXPECT_GT(junk.bytes(), 1u << 20);
  EXPECT_LE(target.bytes_read, (2 + read_for_s) * target.clients << 20) << "1 MiB/s from each client";
  EXPECT_LE(gap_ms, quick ? 5000 : 250);
  if (!quick) {
    EXPECT_GE(static_cast<double>(neighbour.pings), 0.95 * due);
  }
  const double mib = static_cast<double>(junk.bytes()) / (1 << 20);
  keep("junk-rate", format("%lu of %lu; %.0f MiB of junk sent", neighbour.ids_skipped, neighbour.pings, mib), "0",
       neighbour.ids_skipped == 0);
  keep("junk-gap", format("%.0f ms, %.2f Hz", gap_ms, static_cast<double>(neighbour.pings) / due * 40), "at most 250 ms at 40 Hz",
       gap_ms <= 250);
}

}  // namespace
}  // namespace sonar::load
