// The listeners of control: a default address may be in use, a configured address must be free, tokens must exist.
#include <gmock/gmock.h>

#include "tests/daemon/server/control/control_bench.hpp"

namespace sonar::testing_daemon {
namespace {

using ::testing::HasSubstr;

struct Listeners : ::testing::Test {
  Listeners() {
    LogOptions options;
    options.sink = [this](LogLevel, const std::string& line) { log_text += line + "\n"; };
    log = std::make_unique<Log>(options);
    intake = std::make_unique<PoseIntake>(world, clock, *log, [] {});
    admission = std::make_unique<Admission>(limits, *log);
    config.stream.at = config.http.at = {{127, 0, 0, 2}, 0};
  }
  Result<void> open() {
    server = std::make_unique<ControlServer>(io, config, limits, *admission, operations, events, *intake, *log);
    return server->open();
  }
  asio::io_context io{1};
  ControlConfig config;
  LimitConfig limits;
  FakeOperations operations;
  Events events;
  const Clock clock{false};
  World world{PoseRules{}, {{"rov", {}, false}}, {}, Time{}};
  std::string log_text;
  std::unique_ptr<Log> log;
  std::unique_ptr<PoseIntake> intake;
  std::unique_ptr<Admission> admission;
  std::unique_ptr<ControlServer> server;
};

TEST_F(Listeners, DefaultAddressesInUseAreAWarning) {
  tcp::acceptor other(io, {asio::ip::make_address(text_of(config.http.at.ip)), 0});
  config.http.at.port = other.local_endpoint().port();
  ASSERT_TRUE(open());
  EXPECT_EQ(server->http().port, 0);
  EXPECT_NE(server->stream().port, 0);
  EXPECT_THAT(log_text, HasSubstr("continuing without control.http: cannot listen on"));
  server->start();
  server->stop();
}

TEST_F(Listeners, ConfiguredAddressesInUseAreAnError) {
  tcp::acceptor other(io, {asio::ip::make_address(text_of(config.http.at.ip)), 0});
  config.http.at.port = other.local_endpoint().port();
  config.http_given = true;
  const auto r = open();
  ASSERT_FALSE(r);
  EXPECT_EQ(r.error().kind, ErrorKind::unavailable);
  EXPECT_THAT(r.error().text, HasSubstr("control.http in the configuration can set another address, or off"));
}

TEST_F(Listeners, OffIsOff) {
  config.http.enabled = config.stream.enabled = false;
  ASSERT_TRUE(open());
  EXPECT_EQ(server->http().port, 0);
  EXPECT_EQ(server->stream().port, 0);
}

TEST_F(Listeners, AMissingTokenFileEndsTheStart) {
  config.token_file = "no-such-file";
  const auto r = open();
  ASSERT_FALSE(r);
  EXPECT_EQ(r.error().kind, ErrorKind::config);
  EXPECT_THAT(r.error().text, HasSubstr("control.token_file"));
}

}  // namespace
}  // namespace sonar::testing_daemon
