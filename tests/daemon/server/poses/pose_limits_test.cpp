// Limits for senders of poses over TCP: bytes per second, turns, slots, and the end of a connection with another protocol.
#include <gmock/gmock.h>

#include <list>

#include "protocol/control/answers.hpp"
#include "tests/daemon/server/loopback.hpp"

namespace sonar::testing_daemon {
namespace {

using oculus::PingRate;
using ::testing::HasSubstr;

struct PoseLimits : ::testing::Test {
  /// Starts the daemon. `limits`: for example "input_bytes_per_s: 16384".
  void begin(const std::string& limits) {
    DaemonSetup setup;
    setup.vehicle_lines = "  - {name: boat}\n";
    setup.sonar_lines = "    vehicle: rov\n";
    setup.more = "limits: {" + limits + "}\nposes: {protobuf: off, json: '" + setup.address + ":0'}\n";
    daemon.emplace(setup);
    port = daemon->app().poses().json().port;
  }
  static std::string line_at_x(int x, const std::string& vehicle = "rov") {
    return "{\"position\":[0," + std::to_string(x) + ",3],\"attitude\":[0,0,0],\"vehicle\":\"" + vehicle + "\"}\n";
  }
  static std::string lines(std::size_t bytes) {
    std::string text;
    while (text.size() < bytes) text += line_at_x(1);
    return text;
  }
  std::uint64_t heard() {
    const v1::PoseFigures p = daemon->status().poses();
    return p.accepted() + p.refused() + p.late() + p.replaced() + p.over_rate();
  }
  bool is_at_x(int x, int vehicle = 0, milliseconds timeout = patience) {
    return eventually([&] { return daemon->status().vehicles().at(vehicle).position().x() == x; }, timeout);
  }
  /// Connects repeatedly until it is accepted, because initially no connection may be evictable. `meanwhile` is
  /// called before each attempt.
  bool a_newcomer_moves_the_boat(const std::function<void()>& meanwhile = [] {}) {
    return eventually([&] {
      meanwhile();
      Client late(daemon->address(), port);
      late.send(line_at_x(22, "boat"));
      return is_at_x(22, 1, milliseconds(300));
    });
  }
  std::optional<Daemon> daemon;
  std::uint16_t port = 0;
};

TEST_F(PoseLimits, ASenderOfTooManyBytesIsReadSlowly) {
  begin("input_bytes_per_s: 16384");
  Client sender(daemon->address(), port);
  const auto started = Steady::now();
  sender.send(lines(200000));  // about 3800 lines
  ASSERT_TRUE(
      eventually([&] { return daemon->log_text().find("limits.input_bytes_per_s") != std::string::npos && heard() > 0; }));
  const double lines_heard = static_cast<double>(heard());
  const double most_bytes = 16384 * (1 + std::chrono::duration<double>(Steady::now() - started).count());
  EXPECT_LT(lines_heard * 50, most_bytes + 8192);
  EXPECT_THAT(daemon->log_text(), HasSubstr("limits.input_bytes_per_s"));
}

TEST_F(PoseLimits, ManyTogetherAreReadSlowlyAndTheirEndChangesNothing) {
  begin("pose_bytes_per_s: 65536");
  const auto started = Steady::now();
  for (int i = 0; i < 8; ++i) Client(daemon->address(), port).send(lines(40000));  // the client leaves
  ASSERT_TRUE(eventually([&] { return heard() >= 8; })) << "at least the newest pose of each client";
  const double lines_heard = static_cast<double>(heard());
  const double most_bytes = 65536 * (1 + std::chrono::duration<double>(Steady::now() - started).count());
  EXPECT_LT(lines_heard * 50, most_bytes + 8 * 8192);
}

/// After a flood has ended, only its last burst has an effect, and its slot is free.
TEST_F(PoseLimits, FloodsThatHaveEndedMoveNothingAndOccupyNoSlot) {
  begin("input_bytes_per_s: 131072, pose_bytes_per_s: 262144");
  const std::string megabyte = lines(1000000);
  for (int i = 0; i < 32; ++i) Client(daemon->address(), port).send(megabyte + line_at_x(1000 + i));  // the client leaves
  Client honest(daemon->address(), port);
  honest.send(line_at_x(22, "boat"));
  EXPECT_TRUE(is_at_x(22, 1)) << "the client is admitted";
  // At the allowed rate 32 MB would take 2 minutes.
  EXPECT_TRUE(eventually([&] {
    const auto before = heard();
    std::this_thread::sleep_for(milliseconds(500));
    return heard() == before;
  }));
  EXPECT_LT(heard() * 50, 32000000 / 4) << "most lines were dropped";
  honest.send(line_at_x(33, "rov"));
  EXPECT_TRUE(is_at_x(33));
  std::this_thread::sleep_for(milliseconds(300));
  EXPECT_TRUE(is_at_x(33, 0, milliseconds(0))) << "no later line moves the vehicle";
}

/// The sender's kernel stores megabytes after the close and sends them only as fast as this end reads.
TEST_F(PoseLimits, BytesInTheKernelAfterTheEndAreDropped) {
  begin("input_bytes_per_s: 1048576");
  constexpr std::size_t sent = 16 << 20;
  Client(daemon->address(), port).send(lines(sent) + line_at_x(77));  // the client leaves
  EXPECT_TRUE(is_at_x(77));
  EXPECT_LT(heard() * 50, sent / 2);
}

TEST_F(PoseLimits, TheLastPoseOfAClientThatLeavesIsUsed) {
  begin("input_bytes_per_s: 65536");
  for (int i = 1; i <= 5; ++i) {
    Client(daemon->address(), port).send(line_at_x(100 * i));
    EXPECT_TRUE(is_at_x(100 * i)) << "as sent by echo and nc";
  }
  Client(daemon->address(), port).send(lines(3000000) + line_at_x(77));
  EXPECT_TRUE(is_at_x(77)) << "the last of more lines than the limits allow, as cat and nc send them";
}

TEST_F(PoseLimits, ClientsOverTheirLimitAreEvictedForNewOnes) {
  begin("pose_bytes_per_s: 262144");
  std::list<Client> flood;
  for (int i = 0; i < 32; ++i) {
    flood.emplace_back(daemon->address(), port);
    flood.back().send(lines(300000));
  }
  EXPECT_TRUE(a_newcomer_moves_the_boat());
  EXPECT_THAT(daemon->log_text(), HasSubstr("closed to make room: it was idle or over its limit"));
}

TEST_F(PoseLimits, ClientsWithoutPosesAreEvictedForNewOnes) {
  begin("");
  std::list<Client> idle;
  for (int i = 0; i < 32; ++i) idle.emplace_back(daemon->address(), port);
  EXPECT_TRUE(a_newcomer_moves_the_boat([&] {
    for (Client& c : idle) c.send("\n{}\n");
  }));
}

TEST_F(PoseLimits, AFloodCostsOthersNeitherPingsNorTime) {
  begin("pose_bytes_per_s: 131072");
  Client driver(daemon->address()), friendly(daemon->address(), port);
  driver.fire(fire_at(PingRate::hz2));
  const auto first = driver.next_ping();
  ASSERT_TRUE(first);
  std::thread pings([&] {
    for (std::uint32_t i = 1; i <= 6; ++i) {
      const auto ping = driver.next_ping();
      if (!ping) return ADD_FAILURE() << "no ping";
      EXPECT_EQ(ping->head.fixed.ping_id, first->head.fixed.ping_id + i) << "no ping is skipped";
    }
  });
  const auto twenty_poses = [&](int sign) {
    const auto begin = Steady::now();
    for (int x = 100; x <= 2000; x += 100) {  // the jumps prevent interpolation
      friendly.send(line_at_x(sign * x, "boat"));
      EXPECT_TRUE(is_at_x(sign * x, 1)) << x;
    }
    return Steady::now() - begin;
  };
  const auto alone = twenty_poses(-1);  // the time that this machine needs
  std::list<Client> flood;
  for (int i = 0; i < 31; ++i) {
    flood.emplace_back(daemon->address(), port);
    flood.back().send(lines(300000));
  }
  EXPECT_LT(twenty_poses(1), std::chrono::seconds(5) + 10 * alone)
      << "in turns with the flood, each pose would wait for 100 ms or more";
  pings.join();
}

TEST_F(PoseLimits, InvalidJsonIsRefusedAndTheConnectionContinues) {
  begin("");
  const std::string nan = "{\"position\":[0,0,NaN],\"attitude\":[0,0,0]}\n";
  std::string seven;
  for (int i = 0; i < 7; ++i) seven += nan;
  Client friendly(daemon->address(), port);
  friendly.send("\xef\xbb\xbf" + line_at_x(300));
  EXPECT_TRUE(is_at_x(300)) << "after a byte order mark";
  friendly.send(seven + line_at_x(400));
  EXPECT_TRUE(is_at_x(400));
  friendly.send("{\"imu\":\"" + std::string(6000, 'x') + "\"}\n" + seven.substr(0, 6 * nan.size()) + line_at_x(500));
  EXPECT_TRUE(is_at_x(500)) << "a long line counts as one refused line";
  EXPECT_EQ(daemon->status().poses().refused(), 14u);
  friendly.send(seven + nan + line_at_x(600));
  friendly.read_to_end();
  EXPECT_TRUE(friendly.ended) << "eight refused lines in a row end the connection";
  EXPECT_EQ(daemon->status().poses().refused(), 22u);
  EXPECT_EQ(daemon->status().poses().accepted(), 3u);
}

TEST_F(PoseLimits, APageOfTheWebMovesNothing) {
  begin("");
  const std::string body = line_at_x(44);
  const std::string request =
      "POST /x HTTP/1.1\r\nHost: localhost\r\nContent-Type: text/plain\r\nContent-Length: " + std::to_string(body.size()) +
      "\r\n\r\n" + body;
  for (const std::string& page : {request, std::string("POS"), "\n" + body + "nonsense\n" + line_at_x(45)}) {
    Client stranger(daemon->address(), port);
    stranger.send(page);
    stranger.read_to_end();
    EXPECT_TRUE(stranger.ended) << page;
    EXPECT_EQ(stranger.bytes_read, 0u);
  }
  EXPECT_THAT(daemon->log_text(), HasSubstr("pose connection closed: not JSON"));
  EXPECT_EQ(daemon->status().poses().accepted(), 1u) << "the line before the nonsense of the third page";
  EXPECT_EQ(daemon->status().poses().refused(), 3u);
  Client friendly(daemon->address(), port);
  friendly.send("{\"no\":\"pose\"}\n" + line_at_x(7));
  EXPECT_TRUE(is_at_x(7)) << "JSON that is not a pose is refused, and the connection stays";
}

TEST_F(PoseLimits, ABadLineOfADatagramDoesNotAffectTheOthers) {
  begin("");
  send_udp(daemon->address(), port, bytes_of(line_at_x(1, "boat") + "nonsense\n{\"position\":NaN}\n" + line_at_x(2)));
  EXPECT_TRUE(is_at_x(2));
  EXPECT_TRUE(is_at_x(1, 1));
  EXPECT_EQ(daemon->status().poses().refused(), 2u);
}

TEST_F(PoseLimits, AFloodOfDatagramsIsDroppedAndAnotherAddressIsNot) {
  begin("input_bytes_per_s: 16384");
  const auto began = Steady::now();
  for (int i = 0; i < 2000; ++i) send_udp(daemon->address(), port, bytes_of(line_at_x(1)));
  asio::io_context io;
  udp::socket other(io, {asio::ip::make_address("127.0.0.5"), 0});
  EXPECT_TRUE(eventually([&] {
    other.send_to(asio::buffer(line_at_x(7, "boat")), {asio::ip::make_address(daemon->address()), port});
    return is_at_x(7, 1, milliseconds(200));
  }));
  const v1::PoseFigures p = daemon->status().poses();
  const double most_bytes = 16384 * (1 + std::chrono::duration<double>(Steady::now() - began).count());
  EXPECT_LT(static_cast<double>(p.accepted() + p.replaced() + p.over_rate() + p.late()) * 100, most_bytes + 1000);
  EXPECT_GT(p.refused(), 0u);
  EXPECT_THAT(daemon->log_text(), HasSubstr("more than limits.input_bytes_per_s was sent"));
}

TEST_F(PoseLimits, ADatagramMayHave64Lines) {
  begin("");
  send_udp(daemon->address(), port, bytes_of(lines(60000)));
  EXPECT_TRUE(eventually([&] { return daemon->log_text().find("at most 64 lines") != std::string::npos; }));
  EXPECT_EQ(heard(), 65u) << "64 lines, and one refusal for the rest";
}

}  // namespace
}  // namespace sonar::testing_daemon
