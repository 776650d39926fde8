// Tests stepped time: pings must follow one another as fast as the client reads, and every run must give the same bytes.
#include <gmock/gmock.h>

#include "tests/daemon/server/loopback.hpp"

namespace sonar::testing_daemon {
namespace {

using oculus::PingRate;

struct Served {
  std::string sha256, client_sha256;
  std::uint64_t bytes = 0;
  std::vector<Time> times;
};

/// Serves this number of pings to one client. With `dawdle`, the client reads slowly and repeats its request, as some drivers do.
Served serve(std::uint64_t pings, milliseconds engine_takes, bool dawdle) {
  DaemonSetup setup;
  setup.more = "clock: stepped\n";
  setup.sonar_lines = "    options: {dummy_period_ms: 20}\n";  // shorter than a ping, much shorter than the test
  setup.options.exit_after_pings = pings;
  setup.options.digest = true;
  setup.engine_takes = engine_takes;
  Daemon daemon(setup);
  Client client(daemon.address());
  client.digest.emplace();
  if (dawdle) std::this_thread::sleep_for(milliseconds(120));
  client.fire(fire_at(PingRate::hz40));
  for (int i = 0; dawdle && i < 5; ++i) {
    client.next_ping();
    client.fire(fire_at(PingRate::hz40));
    std::this_thread::sleep_for(milliseconds(30));
  }
  EXPECT_TRUE(client.read_to_end());
  EXPECT_EQ(daemon.wait(), 0);
  Served out;
  const auto digests = daemon.app().devices().front().digests();
  EXPECT_EQ(digests.size(), 1u);
  out.sha256 = digests.at(0).sha256;
  out.bytes = digests.at(0).bytes;
  out.client_sha256 = client.digest->hex();
  for (const PingRequest& r : daemon.requests()) out.times.push_back(r.fired_at);
  return out;
}

TEST(Stepped, EqualRunsServeEqualBytesAtAnySpeed) {
  const Served fast = serve(60, milliseconds(0), false);
  const Served slow = serve(60, milliseconds(3), true);
  EXPECT_EQ(fast.sha256, slow.sha256);
  EXPECT_EQ(fast.sha256, fast.client_sha256) << "the digest is that of the bytes that the client received";
  EXPECT_GT(fast.bytes, 60u * 2048u);
  ASSERT_EQ(fast.times.size(), 60u) << "no ping is computed after the last one served";
  EXPECT_EQ(fast.times, slow.times);
  EXPECT_EQ(fast.times[0], Time{});
  EXPECT_EQ(fast.times[59], Time{} + 59 * milliseconds(25)) << "time advances by the period";
}

TEST(Stepped, WaitsForEveryClient) {
  DaemonSetup setup;
  setup.more = "clock: stepped\n";
  setup.sonar_lines = "    clients: {max: 2}\n";
  Daemon daemon(setup);
  Client reader(daemon.address());
  Client sleeper(daemon.address(), 52100, 16384);
  auto fire = fire_at(PingRate::hz40, 4);
  fire.settings.flags |= oculus::flag::beams_512 | oculus::flag::samples_16_bit;
  reader.fire(fire);
  std::uint32_t last = 0;
  for (auto ping = reader.next_ping(); ping; ping = reader.next_ping(milliseconds(500))) last = ping->head.fixed.ping_id;
  ASSERT_GT(last, 0u) << "the kernel's buffers store a few pings";
  for (std::uint32_t i = 1; i <= last + 3; ++i) {
    const auto ping = sleeper.next_ping();
    ASSERT_TRUE(ping);
    EXPECT_EQ(ping->head.fixed.ping_id, i) << "no ping is dropped in stepped time";
  }
  daemon.stop();
}

TEST(Stepped, GainAssistFollowsThePicturesAndStatesItsGain) {
  DaemonSetup setup;
  setup.more = "clock: stepped\n";
  setup.sonar_lines = "    options: {gain_echo: used}\n";
  Daemon daemon(setup);
  Client client(daemon.address());
  auto fire = fire_at(PingRate::hz10);
  fire.settings.flags |= oculus::flag::gain_assist;
  fire.settings.gamma = 255;
  client.fire(fire);
  double expected_db = 0.96 * fire.settings.gain_percent;
  for (int i = 0; i < 5; ++i) {
    const auto ping = client.next_ping();
    ASSERT_TRUE(ping);
    const double gain_db = 0.96 * ping->head.fixed.fire.gain_percent;
    EXPECT_NEAR(gain_db, expected_db, 1e-3) << i;
    // The fake engine's pictures are bright at any gain.
    Ping picture;
    picture.request.settings.format.max_code = 254;
    for (std::size_t row = 0; row < ping->rows(); ++row) {
      const auto samples = ping->row_samples(row);
      picture.samples.insert(picture.samples.end(), samples.begin(), samples.end());
    }
    expected_db = next_gain_db(gain_db, percentile_of_full_scale(picture), 1, 0.1);
    EXPECT_LT(expected_db, gain_db);
  }
  daemon.stop();
}

TEST(Stepped, NothingHappensWithoutAClient) {
  DaemonSetup setup;
  setup.more = "clock: stepped\n";
  Daemon daemon(setup);
  std::this_thread::sleep_for(milliseconds(50));
  EXPECT_TRUE(daemon.requests().empty());
}

}  // namespace
}  // namespace sonar::testing_daemon
