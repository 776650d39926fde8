// Sockets of a made-up sonar, at the address and port of a make.
#pragma once

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <cstdint>
#include <functional>
#include <string>
#include <thread>
#include <utility>

#include "clients/sonarctl/net.hpp"

namespace sonar::clients {

/// Returns a socket of the `type` SOCK_STREAM or SOCK_DGRAM.
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

/// Calls `serve` for each connection in turn, in a thread, until the server is destroyed. Port 0 means any free port.
class SocketServer {
 public:
  using Serve = std::function<void(const Socket&)>;
  SocketServer(std::string address, std::uint16_t port, Serve serve)
      : address_(std::move(address)), listener_(bound_socket(address_, SOCK_STREAM, port)) {
    ::listen(listener_.fd(), 16);
    thread_ = std::thread([this, serve = std::move(serve)] {
      for (;;) {
        const Socket client(::accept4(listener_.fd(), nullptr, nullptr, SOCK_CLOEXEC));
        if (client.fd() < 0) return;
        serve(client);
      }
    });
  }
  ~SocketServer() {
    ::shutdown(listener_.fd(), SHUT_RDWR);
    thread_.join();
  }
  std::string at() const { return text_from({address_, ntohs(own_address(listener_).sin_port)}); }

 private:
  std::string address_;
  Socket listener_;
  std::thread thread_;
};

}  // namespace sonar::clients
