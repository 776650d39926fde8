// A daemon that emulates a sonar of a made-up make, UDP hosts, and the pings that these hosts get.
#pragma once

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <string>
#include <vector>

#include "tests/daemon/server/loopback.hpp"
#include "tests/daemon/server/sonars/made_up_vendor.hpp"

namespace sonar::testing_daemon::transports_test {

inline DaemonSetup made_up(const std::string& more = {}) {
  DaemonSetup setup;
  setup.sonar_lines = "    clients: {max: 2}\n    status_to: ['127.0.0.1:0']\n" + more;
  setup.edit_config = [](Config& config) {
    config.sonars.front().profile = {&made_up_vendor(), made_up_vendor().models().front()};
    config.sonars.front().options.clear();
  };
  return setup;
}

inline std::string text_of(const std::vector<std::byte>& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

class UdpSocket {
 public:
  explicit UdpSocket(const std::string& address = "127.0.0.1", std::uint16_t port = 0) {
    fd_ = socket(AF_INET, SOCK_DGRAM, 0);
    const int on = 1, room = 1 << 20;
    setsockopt(fd_, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
    setsockopt(fd_, SOL_SOCKET, SO_RCVBUF, &room, sizeof room);
    sockaddr_in at = address_of(address, port);
    if (bind(fd_, reinterpret_cast<sockaddr*>(&at), sizeof at) != 0) ADD_FAILURE() << "cannot bind " << address;
    socklen_t size = sizeof at;
    getsockname(fd_, reinterpret_cast<sockaddr*>(&at), &size);
    port_ = ntohs(at.sin_port);
  }
  ~UdpSocket() { ::close(fd_); }
  UdpSocket(const UdpSocket&) = delete;
  UdpSocket& operator=(const UdpSocket&) = delete;

  bool sends_multicast_from(const std::string& interface) {
    const sockaddr_in from = address_of(interface, 0);
    return setsockopt(fd_, IPPROTO_IP, IP_MULTICAST_IF, &from.sin_addr, sizeof from.sin_addr) == 0;
  }
  bool join(const std::string& group, const std::string& interface) {
    ip_mreq wanted{};
    inet_pton(AF_INET, group.c_str(), &wanted.imr_multiaddr);
    inet_pton(AF_INET, interface.c_str(), &wanted.imr_interface);
    return setsockopt(fd_, IPPROTO_IP, IP_ADD_MEMBERSHIP, &wanted, sizeof wanted) == 0;
  }
  void send(const std::string& text, const std::string& address, std::uint16_t port) {
    const sockaddr_in to = address_of(address, port);
    sendto(fd_, text.data(), text.size(), 0, reinterpret_cast<const sockaddr*>(&to), sizeof to);
  }
  /// Returns the next datagram; empty at the deadline.
  std::string next(milliseconds timeout = patience) {
    pollfd p{fd_, POLLIN, 0};
    if (poll(&p, 1, static_cast<int>(timeout.count())) <= 0) return {};
    std::string bytes(65536, '\0');
    sockaddr_in from{};
    socklen_t size = sizeof from;
    const auto n = recvfrom(fd_, bytes.data(), bytes.size(), 0, reinterpret_cast<sockaddr*>(&from), &size);
    bytes.resize(n > 0 ? static_cast<std::size_t>(n) : 0);
    std::array<char, INET_ADDRSTRLEN> ip{};
    inet_ntop(AF_INET, &from.sin_addr, ip.data(), ip.size());
    sender = std::string(ip.data()) + ":" + std::to_string(ntohs(from.sin_port));
    return bytes;
  }
  std::uint16_t port() const { return port_; }
  std::string at() const { return "127.0.0.1:" + std::to_string(port_); }
  std::string sender;  // sender of the last datagram

 private:
  static sockaddr_in address_of(const std::string& address, std::uint16_t port) {
    sockaddr_in at{};
    at.sin_family = AF_INET;
    at.sin_port = htons(port);
    inet_pton(AF_INET, address.c_str(), &at.sin_addr);
    return at;
  }
  int fd_ = -1;
  std::uint16_t port_ = 0;
};

struct Part {
  unsigned ping = 0, part = 0, parts = 0;
  std::string samples;
};
inline Part part_of(const std::string& datagram) {
  Part part;
  EXPECT_EQ(std::sscanf(datagram.c_str(), "PING %u %u %u", &part.ping, &part.part, &part.parts), 3) << datagram;
  part.samples = datagram.substr(datagram.find('\n') + 1);
  return part;
}

/// Returns the samples of the next whole ping.
inline std::string next_ping(UdpSocket& from, unsigned* number = nullptr) {
  Part part = part_of(from.next());
  while (part.part != 0) part = part_of(from.next());
  const unsigned ping = part.ping;
  std::string samples = part.samples;
  while (part.part + 1 < part.parts) {
    const Part next = part_of(from.next());
    EXPECT_EQ(next.ping, ping) << "parts of two pings are mixed";
    EXPECT_EQ(next.part, part.part + 1);
    if (next.ping != ping) return {};
    samples += next.samples;
    part = next;
  }
  if (number != nullptr) *number = ping;
  return samples;
}

inline std::string pattern(unsigned ping, std::size_t rows = 100, std::size_t beams = 32) {
  std::string samples;
  for (std::size_t r = 0; r < rows; ++r)
    for (std::size_t b = 0; b < beams; ++b) samples += static_cast<char>(FakeEngine::sample(ping, r, b));
  return samples;
}

inline std::string ask(Client& client, const std::string& line) {
  client.send(line + "\n");
  return text_of(client.read_raw(3));
}

/// Waits until a ping has this range; a ping that was being computed at the change still has the previous range.
inline bool asked_for_range(Daemon& daemon, double metres) {
  return eventually([&] { return daemon.requests().back().settings.range_m == metres; });
}

}  // namespace sonar::testing_daemon::transports_test
