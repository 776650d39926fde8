// Tests that an exception in one conversation (a bug of sonard) is logged and ends only that conversation.
#include <gmock/gmock.h>

#include "daemon/server/poses/pose_server.hpp"
#include "daemon/server/sonars/session.hpp"
#include "tests/daemon/server/loopback.hpp"
#include "tests/daemon/server/sonars/session_parent.hpp"

namespace sonar::testing_daemon {
namespace {

using ::testing::HasSubstr;

struct ThrowingParent final : QuietParent {
  std::string fault;
  std::size_t on_bytes(ConnectionId, protocol::BytesView) override { throw std::runtime_error("no such luck"); }
  void on_fault(const std::string& what) override { fault = what; }
};

TEST(Exceptions, EndOnlyTheirSession) {
  asio::io_context io;
  tcp::acceptor acceptor(io, {asio::ip::make_address("127.0.0.2"), 0});
  Client client(acceptor.local_endpoint().address().to_string(), acceptor.local_endpoint().port());
  ThrowingParent parent;
  auto session = std::make_shared<Session>(parent, acceptor.accept(), Session::Setup{});
  session->start();
  client.send(std::string("ping, please"));
  io.run_for(patience);
  EXPECT_EQ(parent.fault, "no such luck");
  EXPECT_EQ(parent.why, "an internal fault");
  EXPECT_EQ(session.use_count(), 1) << "no coroutine holds the session";
  EXPECT_FALSE(client.read_to_end());
  EXPECT_TRUE(client.was_reset);
}

struct PoseFaults : ::testing::Test {
  PoseFaults() {
    config.protobuf.enabled = false;
    config.json.at = {{127, 0, 0, 2}, 0};
    LogOptions options;
    options.sink = [this](LogLevel, const std::string& line) { log_text += line + "\n"; };
    log = std::make_unique<Log>(options);
    intake = std::make_unique<PoseIntake>(world, clock, *log, [this] {
      if (++poses == 1) throw std::runtime_error("no such luck");
      io.stop();
    });
    admission = std::make_unique<Admission>(limits, *log);
    server = std::make_unique<PoseServer>(io, config, limits, *admission, *intake, *log);
    if (const auto r = server->open(); !r) throw std::runtime_error(r.error().text);
    server->start();
  }
  ~PoseFaults() override { server->stop(); }
  std::string address() const { return text_of(server->json().ip); }

  asio::io_context io;
  const Clock clock{false};
  World world{PoseRules{}, {{"rov", {}, false}}, {}, clock.now()};
  PoseConfig config;
  LimitConfig limits;
  std::string log_text;
  std::unique_ptr<Log> log;
  std::unique_ptr<PoseIntake> intake;
  std::unique_ptr<Admission> admission;
  std::unique_ptr<PoseServer> server;
  int poses = 0;
};

const std::string pose_line = "{\"position\":[0,1,3],\"attitude\":[0,0,0]}\n";

TEST_F(PoseFaults, AnExceptionInADatagramDoesNotStopTheListener) {
  send_udp(address(), server->json().port, bytes_of(pose_line));
  send_udp(address(), server->json().port, bytes_of(pose_line));
  io.run_for(patience);
  EXPECT_EQ(poses, 2);
  EXPECT_THAT(log_text, HasSubstr("internal fault: no such luck"));
}

TEST_F(PoseFaults, AnExceptionClosesOnlyItsConnection) {
  Client unlucky(address(), server->json().port);
  unlucky.send(pose_line);
  io.run_for(milliseconds(50));
  Client lucky(address(), server->json().port);
  lucky.send(pose_line);
  io.run_for(patience);
  EXPECT_EQ(poses, 2);
  EXPECT_TRUE(unlucky.read_to_end());
  EXPECT_FALSE(lucky.read_to_end(milliseconds(100)));
  EXPECT_FALSE(lucky.ended);
  EXPECT_THAT(log_text, HasSubstr("internal fault: no such luck"));
}

}  // namespace
}  // namespace sonar::testing_daemon
