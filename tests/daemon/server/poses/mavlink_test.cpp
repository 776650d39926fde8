// Poses from MAVLink over real sockets: messages move the sonar, other bytes are counted, and the autopilot gets our messages.
#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <fstream>

#include "protocol/control/answers.hpp"
#include "protocol/mavlink/frames.hpp"
#include "tests/daemon/server/loopback.hpp"

namespace sonar::testing_daemon {
namespace {

using oculus::PingRate;
using ::testing::HasSubstr;

/// A vehicle's end of the link: a UDP socket on an address, with deadlines.
class Vehicle {
 public:
  explicit Vehicle(const std::string& address) : socket_(::socket(AF_INET, SOCK_DGRAM, 0)) {
    const timeval limit{20, 0};
    ::setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit);
    sockaddr_in at = place(address, 0);
    EXPECT_EQ(::bind(socket_, reinterpret_cast<const sockaddr*>(&at), sizeof at), 0);
    socklen_t size = sizeof at;
    EXPECT_EQ(::getsockname(socket_, reinterpret_cast<sockaddr*>(&at), &size), 0);
    port = ntohs(at.sin_port);
  }
  ~Vehicle() { ::close(socket_); }
  Vehicle(const Vehicle&) = delete;
  Vehicle& operator=(const Vehicle&) = delete;

  void send(const std::string& address, std::uint16_t to, const mavlink::Bytes& bytes) {
    const sockaddr_in at = place(address, to);
    EXPECT_EQ(::sendto(socket_, bytes.data(), bytes.size(), 0, reinterpret_cast<const sockaddr*>(&at), sizeof at),
              static_cast<ssize_t>(bytes.size()));
  }
  /// Returns the next message with this number; `from_port` is the sender's port.
  std::optional<mavlink::Frame> next(std::uint32_t id) {
    for (int i = 0; i < 100; ++i) {
      mavlink::Bytes bytes(2048);
      sockaddr_in from{};
      socklen_t size = sizeof from;
      const ssize_t n = ::recvfrom(socket_, bytes.data(), bytes.size(), 0, reinterpret_cast<sockaddr*>(&from), &size);
      if (n <= 0) return std::nullopt;
      from_port = ntohs(from.sin_port);
      bytes.resize(static_cast<std::size_t>(n));
      mavlink::FrameReader frames(bytes);
      while (auto frame = frames.next()) {
        if (frame->id == id) return frame;
        if (frame->id == mavlink::CommandLong::id) ++commands;
      }
    }
    return std::nullopt;
  }
  mavlink::Bytes next_datagram() {
    mavlink::Bytes bytes(2048);
    const ssize_t n = ::recv(socket_, bytes.data(), bytes.size(), 0);
    bytes.resize(n > 0 ? static_cast<std::size_t>(n) : 0);
    return bytes;
  }
  std::uint16_t port = 0, from_port = 0;
  int commands = 0;
  mavlink::Identity who{1, 1, 0};

 private:
  static sockaddr_in place(const std::string& address, std::uint16_t port) {
    sockaddr_in at{};
    at.sin_family = AF_INET;
    at.sin_port = htons(port);
    ::inet_pton(AF_INET, address.c_str(), &at.sin_addr);
    return at;
  }
  int socket_;
};

DaemonSetup with_link(const std::string& link, const std::string& more = {}) {
  DaemonSetup s;
  std::string endpoint = link;
  if (const auto at = endpoint.find("HERE"); at != std::string::npos) endpoint.replace(at, 4, s.address);
  s.more = "poses: {protobuf: off, json: off, mavlink: [{endpoint: '" + endpoint + "'" + more + "}]}\n";
  return s;
}
mavlink::Odometry odometry_at(float north_m, std::uint64_t time_us) {
  mavlink::Odometry m;
  m.time_us = time_us;
  m.x_m = north_m, m.z_m = 3;
  m.frame_id = 1, m.child_frame_id = 12;
  return m;
}

struct Mavlink : ::testing::Test {
  /// Returns true if a later ping was requested at y metres north.
  static bool asked_from(Daemon& daemon, Client& client, double y) {
    return eventually([&] {
      client.next_ping(milliseconds(100));
      const auto all = daemon.requests();
      return !all.empty() && std::abs(all.back().vehicle_in_world.position_m.y - y) < 1e-6;
    });
  }
};

TEST_F(Mavlink, AListeningLinkMovesTheSonarAndAnswersWithHeartbeats) {
  Daemon daemon(with_link("udpin:HERE:0", ", request_rates: true"));
  Client client(daemon.address());
  client.fire(fire_at(PingRate::hz40));
  const std::uint16_t port = daemon.app().mavlink().listens_at(0).port;
  Vehicle vehicle(daemon.address());
  mavlink::Heartbeat beat;
  beat.type = 12, beat.autopilot = 3;
  vehicle.send(daemon.address(), port, framed(beat, vehicle.who));
  const auto answer = vehicle.next(mavlink::Heartbeat::id);
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->system, 1);
  EXPECT_EQ(answer->component, mavlink::MavlinkPoses::own_component);
  EXPECT_EQ(vehicle.from_port, port);
  ASSERT_TRUE(vehicle.next(mavlink::Heartbeat::id));
  EXPECT_GE(vehicle.commands, 3) << "too few requests for messages";

  vehicle.send(daemon.address(), port, framed(odometry_at(11, 1'000'000), vehicle.who));
  EXPECT_TRUE(asked_from(daemon, client, 11));
  const std::string source = "mavlink udpin:" + daemon.address() + ":" + std::to_string(port) + " system 1 ODOMETRY";
  EXPECT_THAT(daemon.log_text(), HasSubstr("pose source of rov changed: initial pose -> " + source +
                                           "; fields: position attitude velocity rates (NED/FRD)"));
  EXPECT_TRUE(eventually([&] { return daemon.log_text().find(": system 1 (ArduPilot) sends HEARTBEAT") != std::string::npos; }));
  EXPECT_EQ(daemon.status().vehicles().at(0).source(), source);
}

/// A BlueROV2 without a DVL needs no further configuration.
TEST_F(Mavlink, DepthAndAttitudeMoveAVehicleAtItsInitialPlace) {
  DaemonSetup setup = with_link("udpin:HERE:0");
  setup.edit_config = [](Config& config) { config.vehicles.front().initial_pose.position_m = {5, 6, -1}; };
  Daemon daemon(setup);
  const std::uint16_t port = daemon.app().mavlink().listens_at(0).port;
  Vehicle vehicle(daemon.address());
  mavlink::GlobalPositionInt depth;
  depth.boot_ms = 1000, depth.height_mm = -4500;
  mavlink::Attitude attitude;
  attitude.boot_ms = 1100, attitude.yaw_rad = 1;
  vehicle.send(daemon.address(), port, framed(depth, vehicle.who));
  vehicle.send(daemon.address(), port, framed(attitude, vehicle.who));
  const auto pose = [&] { return daemon.status().vehicles().at(0).position(); };
  EXPECT_TRUE(eventually([&] { return std::abs(pose().z() + 4.5) < 1e-6; })) << pose().z();
  EXPECT_EQ(pose().x(), 5);
  EXPECT_EQ(pose().y(), 6);
  EXPECT_TRUE(eventually([&] { return daemon.log_text().find("x and y are held at 5, 6") != std::string::npos; }));
}

TEST_F(Mavlink, ADiallingLinkSpeaksFirst) {
  const std::string here = "127.0.0.3";
  Vehicle vehicle(here);
  Daemon daemon(with_link("udpout:" + here + ":" + std::to_string(vehicle.port)));
  Client client(daemon.address());
  client.fire(fire_at(PingRate::hz40));
  ASSERT_TRUE(vehicle.next(mavlink::Heartbeat::id));
  const std::uint16_t port = vehicle.from_port;
  vehicle.send("127.0.0.1", port, framed(odometry_at(12, 1'000'000), vehicle.who));
  EXPECT_TRUE(asked_from(daemon, client, 12));

  Vehicle stranger("127.0.0.4");
  stranger.send("127.0.0.1", port, framed(odometry_at(500, 2'000'000), stranger.who));
  EXPECT_TRUE(eventually([&] { return daemon.log_text().find("not the one that was dialled") != std::string::npos; }));
  EXPECT_TRUE(asked_from(daemon, client, 12));
}

TEST_F(Mavlink, ACommandToInjectAFailureIsAnsweredToItsSender) {
  Daemon daemon(with_link("udpin:HERE:0"));
  const std::uint16_t port = daemon.app().mavlink().listens_at(0).port;
  Vehicle vehicle(daemon.address()), ground(daemon.address());
  vehicle.send(daemon.address(), port, framed(odometry_at(1, 1'000'000), vehicle.who));
  ASSERT_TRUE(vehicle.next(mavlink::Heartbeat::id));
  mavlink::CommandLong command;
  command.param1 = mavlink::distance_sensor, command.param2 = 1;
  command.command = mavlink::CommandLong::inject_failure, command.target_system = 1, command.target_component = 193;
  mavlink::Identity station{255, 190, 0};
  ground.send(daemon.address(), port, framed(command, station));
  const mavlink::Bytes ack = ground.next_datagram();
  ASSERT_GT(ack.size(), 12u);
  EXPECT_EQ(ack[7], static_cast<std::byte>(mavlink::CommandAck::id));
  EXPECT_EQ(ack[12], static_cast<std::byte>(mavlink::MavResult::denied)) << "faults are not armed";
  ASSERT_TRUE(vehicle.next(mavlink::Heartbeat::id)) << "the vehicle is still the peer";
}

TEST_F(Mavlink, AFailureIsAFaultOfTheSonarsUntilOkIsSent) {
  using enum mavlink::FailureType;
  using enum mavlink::MavResult;
  DaemonSetup setup = with_link("udpin:HERE:0");
  setup.edit_config = [](Config& config) { config.faults.armed = true; };
  Daemon daemon(setup);
  const std::uint16_t port = daemon.app().mavlink().listens_at(0).port;
  Vehicle vehicle(daemon.address()), ground(daemon.address());
  vehicle.send(daemon.address(), port, framed(odometry_at(1, 1'000'000), vehicle.who));
  ASSERT_TRUE(vehicle.next(mavlink::Heartbeat::id));
  mavlink::Identity station{255, 190, 0};
  const auto inject = [&](std::uint32_t unit, mavlink::FailureType type, std::uint32_t instance) {
    mavlink::CommandLong command;
    command.param1 = static_cast<float>(unit), command.param2 = static_cast<float>(type),
    command.param3 = static_cast<float>(instance);
    command.command = mavlink::CommandLong::inject_failure, command.target_system = 1, command.target_component = 193;
    ground.send(daemon.address(), port, framed(command, station));
    const mavlink::Bytes ack = ground.next_datagram();
    return ack.size() > 12 ? static_cast<mavlink::MavResult>(ack[12]) : failed;
  };
  const auto acting = [&] {
    std::string codes;
    const auto report = daemon.ask(control::GetFaults{}).faults;
    for (const v1::FaultStatus& fault : report->faults())
      if (fault.state() != "over") codes += fault.code() + " " + fault.name() + " " + fault.sonar() + ";";
    return codes;
  };
  const std::string sonar = daemon.app().devices().front().config().name;
  const std::pair<mavlink::FailureType, std::string> kinds[] = {
      {off, "L05"}, {stuck, "P01"}, {garbage, "P04"}, {wrong, "P12"}, {slow, "T11"}, {delayed, "T10"}, {intermittent, "P13"}};
  for (const auto& [type, code] : kinds)
    for (const std::uint32_t instance : {0u, 1u}) {
      EXPECT_EQ(inject(mavlink::distance_sensor, type, instance), accepted) << code;
      EXPECT_EQ(acting(), code + " mavlink " + sonar + ";") << "the failure replaces the previous one";
    }
  EXPECT_EQ(inject(4, off, 0), unsupported) << "sonard has no GPS receiver";
  EXPECT_EQ(inject(mavlink::distance_sensor, off, 2), denied) << "there is one sonar";
  EXPECT_EQ(acting(), "P13 mavlink " + sonar + ";");
  EXPECT_EQ(inject(mavlink::distance_sensor, ok, 0), accepted);
  EXPECT_EQ(acting(), "");
  EXPECT_EQ(inject(mavlink::distance_sensor, ok, 1), accepted) << "`ok` is accepted also when no fault is active";
}

TEST_F(Mavlink, WithATokenNoFailureIsInjected) {
  const std::string token = ::testing::TempDir() + "mavlink-token-" + std::to_string(::getpid());
  std::ofstream(token) << "0123456789abcdef-lab\n";
  DaemonSetup setup = with_link("udpin:HERE:0");
  setup.edit_config = [token](Config& config) {
    config.faults.armed = true;
    config.control.token_file = token;
  };
  Daemon daemon(setup);
  const std::uint16_t port = daemon.app().mavlink().listens_at(0).port;
  Vehicle vehicle(daemon.address()), ground(daemon.address());
  vehicle.send(daemon.address(), port, framed(odometry_at(1, 1'000'000), vehicle.who));
  ASSERT_TRUE(vehicle.next(mavlink::Heartbeat::id));
  mavlink::CommandLong command;
  command.param1 = mavlink::distance_sensor, command.param2 = 1;
  command.command = mavlink::CommandLong::inject_failure, command.target_system = 1, command.target_component = 193;
  mavlink::Identity station{255, 190, 0};
  ground.send(daemon.address(), port, framed(command, station));
  const mavlink::Bytes ack = ground.next_datagram();
  ASSERT_GT(ack.size(), 12u);
  EXPECT_EQ(ack[12], static_cast<std::byte>(mavlink::MavResult::denied));
  EXPECT_EQ(daemon.ask(control::GetFaults{}).faults->faults_size(), 0);
  EXPECT_THAT(daemon.log_text(), HasSubstr("cannot show the token of control.token_file"));
  std::remove(token.c_str());
}

TEST_F(Mavlink, NonsenseIsCountedAndChangesNothing) {
  Daemon daemon(with_link("udpin:HERE:0"));
  const std::uint16_t port = daemon.app().mavlink().listens_at(0).port;
  Vehicle vehicle(daemon.address());
  vehicle.send(daemon.address(), port, mavlink::Bytes(64, std::byte{0x55}));
  mavlink::Bytes damaged = framed(odometry_at(11, 1), vehicle.who);
  damaged[30] ^= std::byte{1};
  vehicle.send(daemon.address(), port, damaged);
  EXPECT_TRUE(eventually([&] { return daemon.status().poses().refused() == 2; }));
  EXPECT_EQ(daemon.status().poses().accepted(), 0u);
  EXPECT_THAT(daemon.log_text(), HasSubstr("pose refused: 64 bytes are not MAVLink"));
  EXPECT_THAT(daemon.log_text(), HasSubstr("wrong checksum"));
}

TEST_F(Mavlink, OnlyConfiguredSendersAreAccepted) {
  DaemonSetup setup = with_link("udpin:HERE:0");
  setup.more.insert(setup.more.find("protobuf"), "allow_from: [10.0.0.0/8], ");
  Daemon daemon(setup);
  Vehicle vehicle(daemon.address());
  vehicle.send(daemon.address(), daemon.app().mavlink().listens_at(0).port, framed(odometry_at(11, 1), vehicle.who));
  EXPECT_TRUE(eventually([&] { return daemon.log_text().find("address is not in poses.allow_from") != std::string::npos; }));
  EXPECT_EQ(daemon.status().poses().accepted(), 0u);
}

TEST_F(Mavlink, AnEndpointInUseIsOneErrorLine) {
  const std::string here = "127.0.0.3";
  Vehicle first(here);
  try {
    Daemon daemon(with_link("udpin:" + here + ":" + std::to_string(first.port)));
    FAIL() << "the port was taken";
  } catch (const std::runtime_error& e) {
    EXPECT_THAT(e.what(), HasSubstr("poses.mavlink in the configuration can set another address"));
  }
}

}  // namespace
}  // namespace sonar::testing_daemon
