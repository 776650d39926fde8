// What senders of poses by TCP may cost: bytes a second, turns, places, and the connection when they speak something else.
#include <gmock/gmock.h>

#include <list>

#include "tests/daemon/loopback.hpp"

namespace sonar::testing_daemon {
namespace {

using oculus::PingRate;
using ::testing::HasSubstr;

struct PoseLimits : ::testing::Test {
  /// `limits`: "input_bytes_per_s: 16384"
  void begin(const std::string& limits) {
    DaemonSetup setup;
    setup.more = "limits: {" + limits + "}\nposes: {protobuf: off, json: '" + setup.address + ":0'}\n";
    daemon.emplace(setup);
    port = daemon->app().poses().json().port;
  }
  static std::string line_at_x(int x) { return "{\"position\":[0," + std::to_string(x) + ",3],\"attitude\":[0,0,0]}\n"; }
  static std::string lines(std::size_t bytes) {
    std::string text;
    while (text.size() < bytes) text += line_at_x(1);
    return text;
  }
  std::uint64_t heard() {
    const control::PoseFigures p = daemon->status().poses;
    return p.accepted + p.refused + p.late + p.replaced + p.over_rate;
  }
  bool is_at_x(int x) {
    return eventually([&] { return daemon->status().vehicles.at(0).in_world.position_m.x == x; });
  }
  std::optional<Daemon> daemon;
  std::uint16_t port = 0;
};

TEST_F(PoseLimits, OneThatSendsTooMuchIsReadSlowly) {
  begin("input_bytes_per_s: 16384");
  Client sender(daemon->address(), port);
  const auto started = Steady::now();
  sender.send(lines(200000));  // about 3800
  std::this_thread::sleep_for(milliseconds(1000));
  const double lines_heard = static_cast<double>(heard());
  const double most_bytes = 16384 * (1 + std::chrono::duration<double>(Steady::now() - started).count());
  EXPECT_GT(lines_heard, 100);
  EXPECT_LT(lines_heard * 50, most_bytes + 8192);
  EXPECT_THAT(daemon->log_text(), HasSubstr("limits.input_bytes_per_s"));
}

TEST_F(PoseLimits, ManyTogetherAreReadSlowlyAndTheirEndChangesNothing) {
  begin("pose_bytes_per_s: 16384");
  const auto started = Steady::now();
  for (int i = 0; i < 8; ++i) Client(daemon->address(), port).send(lines(40000));  // and gone
  std::this_thread::sleep_for(milliseconds(1000));
  const double lines_heard = static_cast<double>(heard());
  const double most_bytes = 16384 * (1 + std::chrono::duration<double>(Steady::now() - started).count());
  EXPECT_GT(lines_heard, 100);
  EXPECT_LT(lines_heard * 50, most_bytes + 8 * 8192);
}

TEST_F(PoseLimits, ThoseBehindGiveTheirPlacesToNewcomers) {
  begin("pose_bytes_per_s: 262144");
  std::list<Client> flood;
  for (int i = 0; i < 32; ++i) {
    flood.emplace_back(daemon->address(), port);
    flood.back().send(lines(300000));
  }
  std::this_thread::sleep_for(milliseconds(1500));
  Client late(daemon->address(), port);
  late.send("{\"position\":[0,22,3],\"attitude\":[0,0,0],\"vehicle\":\"rov\"}\n");
  EXPECT_TRUE(eventually([&] { return daemon->log_text().find("or behind, and its place was needed") != std::string::npos; }));
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
  EXPECT_EQ(daemon->status().poses.accepted, 1u) << "the line before the nonsense of the third";
  EXPECT_EQ(daemon->status().poses.refused, 3u);
  Client friendly(daemon->address(), port);
  friendly.send("{\"no\":\"pose\"}\n" + line_at_x(7));
  EXPECT_TRUE(is_at_x(7)) << "JSON that is no pose is refused, and costs the connection nothing";
}

TEST_F(PoseLimits, ADatagramHasSoManyLines) {
  begin("");
  send_udp(daemon->address(), port, bytes_of(lines(60000)));
  EXPECT_TRUE(eventually([&] { return daemon->log_text().find("at most 64 lines") != std::string::npos; }));
  EXPECT_EQ(heard(), 65u) << "and one refusal for the rest";
}

}  // namespace
}  // namespace sonar::testing_daemon
