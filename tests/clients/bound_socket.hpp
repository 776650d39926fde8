// A socket of a made-up sonar, at the address and port of a make.
#pragma once

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <cstdint>
#include <string>

#include "clients/sonarctl/net.hpp"

namespace sonar::clients {

/// `type`: SOCK_STREAM or SOCK_DGRAM.
inline Socket bound_socket(const std::string& address, int type, std::uint16_t port) {
  Socket socket(::socket(AF_INET, type | SOCK_CLOEXEC, 0));
  const int yes = 1;
  ::setsockopt(socket.fd(), SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  sockaddr_in at{};
  at.sin_family = AF_INET;
  at.sin_port = htons(port);
  ::inet_pton(AF_INET, address.c_str(), &at.sin_addr);
  // The sockets interface requires this cast.
  EXPECT_EQ(::bind(socket.fd(), reinterpret_cast<sockaddr*>(&at), sizeof at), 0);
  return socket;
}

}  // namespace sonar::clients
