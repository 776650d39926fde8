// Tests network actions that a sonar requests from its device: closing a port, resetting a client, not reading from a client.
#include "daemon/server/sonars/device.hpp"

#include <gmock/gmock.h>

#include <fstream>

#include "tests/daemon/server/loopback.hpp"

namespace sonar::testing_daemon {
namespace {

using ::testing::HasSubstr;

struct Parent final : DeviceParent {
  void compute(const Device&, PingRequest, Simulator::Done) override {}
  void on_ping_queued(const Device&, const PingQueued&) override {}
  void on_client(const Device&, const std::string&, bool, const std::string&) override {}
  void on_stop(const Device&, const std::string&) override {}
  void on_change() override {}
  void on_engine_failure(const Error&) override {}
};

Config config_of(const DaemonSetup& setup) {
  std::ofstream(::testing::TempDir() + "/scene.yaml") << "name: test\n";
  auto config = parse_config(yaml_of(setup), "test.yaml", ::testing::TempDir());
  if (!config) throw std::runtime_error(config.error().text);
  return *std::move(config);
}
DaemonSetup queueing() {
  DaemonSetup setup;
  setup.sonar_lines = "    clients: {max: 1, when_full: queue}\n    observers: {port: 52101}\n";
  return setup;
}

struct DeviceActions : ::testing::Test {
  DeviceActions() {
    if (const auto opened = device.open(); !opened) throw std::runtime_error(opened.error().text);
    device.start();
  }
  ~DeviceActions() override {
    device.stop();
    run(milliseconds(300));  // a stopped listener must live for 100 ms
  }
  void run(milliseconds time) {
    io.restart();
    io.run_for(time);
  }
  bool refuses(std::uint16_t port) {
    tcp::socket visitor(io);
    error_code ec;
    visitor.connect({asio::ip::make_address(setup.address), port}, ec);
    return ec == asio::error::connection_refused;
  }
  template <class Done>
  bool soon(Done done) {
    return eventually([&] {
      run(milliseconds(5));
      return done();
    });
  }

  DaemonSetup setup = queueing();
  Config config = config_of(setup);
  asio::io_context io;
  Clock clock{false};
  World world{PoseRules{}, {{"rov", {}, false}}, {}, clock.now()};
  std::string log_text;
  Log log{[this] {
    LogOptions options;
    options.sink = [this](LogLevel, const std::string& line) { log_text += line + "\n"; };
    return options;
  }()};
  Admission admission{config.limits, log};
  DeviceNetwork network{io, clock, admission, log};
  Parent parent;
  Device device{network, {config, world}, config.sonars.front(), 0, parent};
};

TEST_F(DeviceActions, ListenClosesAndOpensThePortOfClientsOnly) {
  Client early(setup.address);
  ASSERT_TRUE(soon([&] { return device.sonar().connections().clients() == 1; }));
  for (int round = 0; round < 3; ++round) {
    device.perform({Listen{false}});
    EXPECT_EQ(device.data_endpoint().port, 52100);
    EXPECT_EQ(device.problem(), "") << "a port closed on request is no problem";
    EXPECT_TRUE(refuses(52100));
    EXPECT_FALSE(refuses(52101));
    run(milliseconds(20));
    EXPECT_TRUE(refuses(52100));
    device.perform({Listen{true}, Listen{true}});
    EXPECT_FALSE(refuses(52100)) << "the port opens at once";
  }
  EXPECT_EQ(device.sonar().connections().clients(), 1u) << "the connection is kept";
  EXPECT_FALSE(early.ended);
  Client late(setup.address);
  EXPECT_TRUE(soon([&] { return device.sonar().connections().waiting() > 0; })) << "connections are accepted again";
}

TEST_F(DeviceActions, ListenTriesAgainWhileAnotherProgramHasThePort) {
  device.perform({Listen{false}});
  {
    tcp::acceptor other(io, {asio::ip::make_address(setup.address), 52100});
    device.perform({Listen{true}});
    run(milliseconds(200));
    EXPECT_THAT(log_text, HasSubstr("port in use by another program"));
    EXPECT_EQ(log_text.find("port in use"), log_text.rfind("port in use")) << "the log line is not repeated";
    EXPECT_NE(device.problem(), "");
  }
  EXPECT_TRUE(soon([&] { return !refuses(52100); }));
  EXPECT_EQ(device.problem(), "");
  Client client(setup.address);
  EXPECT_TRUE(soon([&] { return device.sonar().connections().clients() == 1; }));
}

TEST_F(DeviceActions, AfterAStopAClosedPortStaysClosed) {
  device.perform({Listen{false}});
  device.stop();
  device.perform({Listen{true}});
  run(milliseconds(200));
  EXPECT_TRUE(refuses(52100));
}

TEST_F(DeviceActions, RefuseCanResetTheConnection) {
  Client served(setup.address);
  ASSERT_TRUE(soon([&] { return device.sonar().connections().clients() == 1; }));
  Client waits(setup.address);
  ASSERT_TRUE(soon([&] { return device.sonar().connections().waiting() == 1; }));
  device.perform({Refuse{2, true}});
  EXPECT_FALSE(waits.read_to_end());
  EXPECT_TRUE(waits.was_reset);
  EXPECT_THAT(log_text, HasSubstr("client refused: reset"));
}

TEST_F(DeviceActions, AClientThatIsNotReadFillsItsWindowAndLosesNothing) {
  Client client(setup.address);
  ASSERT_TRUE(soon([&] { return device.sonar().connections().clients() == 1; }));
  const auto read = [&] { return device.sonar().connections().find(1)->bytes_read; };
  device.perform({ReadFrom{1, false}, ReadFrom{99, false}});
  client.fire(fire_at(oculus::PingRate::hz10));
  run(milliseconds(100));
  EXPECT_EQ(read(), 0u);
  client.fire(fire_at(oculus::PingRate::hz10));
  run(milliseconds(100));
  EXPECT_EQ(read(), 0u);
  device.perform({ReadFrom{1, true}});
  EXPECT_TRUE(soon([&] { return read() == 2 * oculus::fire_v1_size; }));
}

}  // namespace
}  // namespace sonar::testing_daemon
