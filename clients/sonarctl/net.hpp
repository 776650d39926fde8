// Plain blocking sockets with deadlines: what a driver's side needs and no more. IPv4, as the devices speak it.
// Used by listen (TCP in, UDP discovery) and pose (UDP out).
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/base/result.hpp"

namespace sonar::clients {

struct Endpoint {
  std::string host;
  std::uint16_t port = 0;
};
std::string text_from(const Endpoint& endpoint);  // "127.0.0.2:52100"
/// "host", "host:port" or ":port"; what is missing comes from `fallback`.
Result<Endpoint> parse_endpoint(const std::string& text, const Endpoint& fallback);

/// Owns a file descriptor.
class Socket {
 public:
  explicit Socket(int fd) : fd_(fd) {}
  Socket(Socket&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  Socket& operator=(Socket&& other) noexcept {
    std::swap(fd_, other.fd_);
    return *this;
  }
  ~Socket();
  int fd() const { return fd_; }

 private:
  int fd_ = -1;
};

/// Retries until `patience` is over, so that a daemon that is still starting is met.
Result<Socket> connect_tcp(const Endpoint& to, std::chrono::milliseconds patience);
/// The same for several places, tried in turn: the socket of the first that accepts, and which that is.
struct Connected {
  Socket socket;
  std::size_t which = 0;
};
Result<Connected> connect_first(const std::vector<Endpoint>& places, std::chrono::milliseconds patience);
Result<Socket> connect_udp(const Endpoint& to);
/// Bound with address reuse: other listeners on this machine keep their share of broadcasts.
Result<Socket> listen_udp(const Endpoint& at);
inline Result<Socket> listen_udp(std::uint16_t port) { return listen_udp(Endpoint{"0.0.0.0", port}); }

enum class Wait { data, timed_out, interrupted, closed };
struct Read {
  Wait what = Wait::timed_out;
  std::size_t size = 0;
  std::string error;  // why a connection is closed, when it was not simply ended
};
Read read_some(const Socket& socket, std::span<std::byte> into, std::chrono::milliseconds patience);
/// Nothing is read. False when a byte is there, or neither comes within `patience`.
bool ends_without_a_byte(const Socket& socket, std::chrono::milliseconds patience);
Result<void> write_all(const Socket& socket, std::span<const std::byte> bytes);

}  // namespace sonar::clients
