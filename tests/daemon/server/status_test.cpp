// Tests the beacon of an Oculus: its start, its source address, and its data about the connected client.
#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include "tests/daemon/server/loopback.hpp"

namespace sonar::testing_daemon {
namespace {

using ::testing::IsEmpty;

/// A driver's status listener on a free port.
class Listener {
 public:
  Listener() : fd_(socket(AF_INET, SOCK_DGRAM, 0)) {
    sockaddr_in any{};
    any.sin_family = AF_INET;
    inet_pton(AF_INET, "127.0.0.1", &any.sin_addr);
    EXPECT_EQ(bind(fd_, static_cast<sockaddr*>(static_cast<void*>(&any)), sizeof any), 0);
    socklen_t size = sizeof any;
    getsockname(fd_, static_cast<sockaddr*>(static_cast<void*>(&any)), &size);
    port = ntohs(any.sin_port);
  }
  ~Listener() { ::close(fd_); }
  struct Received {
    oculus::StatusMessage status;
    std::size_t size = 0;
    std::string from;
    std::uint16_t from_port = 0;
  };
  std::optional<Received> next() {
    pollfd p{fd_, POLLIN, 0};
    if (poll(&p, 1, static_cast<int>(patience.count())) <= 0) return std::nullopt;
    std::vector<std::byte> buffer(2048);
    sockaddr_in from{};
    socklen_t size = sizeof from;
    const auto n = recvfrom(fd_, buffer.data(), buffer.size(), 0, static_cast<sockaddr*>(static_cast<void*>(&from)), &size);
    buffer.resize(static_cast<std::size_t>(n));
    char text[64] = {};
    inet_ntop(AF_INET, &from.sin_addr, text, sizeof text);
    const auto status = oculus::decode_status(buffer);
    if (!status) return std::nullopt;
    return Received{*status, buffer.size(), text, ntohs(from.sin_port)};
  }
  std::uint16_t port = 0;

 private:
  int fd_;
};

TEST(Status, ComesFromTheSonarsAddressAndFollowsTheConnection) {
  Listener listener;
  DaemonSetup setup;
  setup.sonar_lines = "    device_id: 4711\n    status_to: ['127.0.0.1:" + std::to_string(listener.port) + "']\n";
  Daemon daemon(setup);
  const auto first = listener.next();
  ASSERT_TRUE(first);
  EXPECT_EQ(first->size, 142u);
  EXPECT_THAT(oculus::status_violations(first->status, first->size), IsEmpty());
  EXPECT_EQ(first->status.device_id, 4711u);
  EXPECT_EQ(first->status.header.source, 4711u);
  EXPECT_EQ(first->from, daemon.address()) << "some drivers connect to the source, some to the payload";
  EXPECT_EQ(text_of(protocol::Ipv4(first->status.ip_address)), daemon.address());
  EXPECT_NE(first->from_port, 52102) << "drivers listen at that port";
  EXPECT_EQ(first->status.connected_ip, (std::array<std::uint8_t, 4>{}));
  {
    Client client(daemon.address());  // TCP is ready before the first status
    EXPECT_TRUE(eventually([&] { return listener.next()->status.connected_ip == std::array<std::uint8_t, 4>{127, 0, 0, 1}; }));
  }
  EXPECT_TRUE(eventually([&] { return listener.next()->status.connected_ip == std::array<std::uint8_t, 4>{}; }));
}

TEST(Status, ComesOncePerSecond) {
  Listener listener;
  DaemonSetup setup;
  setup.sonar_lines = "    status_to: ['127.0.0.1:" + std::to_string(listener.port) + "']\n";
  const auto begin = Steady::now();  // the first status is sent after this time, even if it is read late
  Daemon daemon(setup);
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(listener.next());
  const auto took = Steady::now() - begin;
  EXPECT_GT(took, milliseconds(1800));
  EXPECT_LT(took, patience);
}

TEST(Status, AdvertisesTheConfiguredAddress) {
  Listener listener;
  DaemonSetup setup;
  setup.sonar_lines = "    advertise_ip: 127.9.9.9\n    status_to: ['127.0.0.1:" + std::to_string(listener.port) + "']\n";
  Daemon daemon(setup);
  const auto received = listener.next();
  ASSERT_TRUE(received);
  EXPECT_EQ(text_of(protocol::Ipv4(received->status.ip_address)), "127.9.9.9");
}

}  // namespace
}  // namespace sonar::testing_daemon
