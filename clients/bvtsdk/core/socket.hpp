// A TCP stream with deadlines, on plain POSIX sockets. The link uses it.
#pragma once

#include <chrono>
#include <string>

#include "clients/bvtsdk/core/bytes.hpp"
#include "clients/bvtsdk/core/codes.hpp"

namespace sonar::bvt {

using Deadline = std::chrono::steady_clock::time_point;

/// Owns a file descriptor.
class Descriptor {
 public:
  explicit Descriptor(int fd = -1) : fd_(fd) {}
  Descriptor(Descriptor&& other) noexcept : fd_(other.fd_) { other.fd_ = -1; }
  Descriptor& operator=(Descriptor&& other) noexcept;
  ~Descriptor();
  int fd() const { return fd_; }
  explicit operator bool() const { return fd_ >= 0; }

 private:
  int fd_;
};

/// Splits "host" or "host:port". Returns false if the host is empty or the port is not a number from 1 to 65535.
bool split_endpoint(const std::string& endpoint, std::string& host, std::string& port);

/// Connects to the first address of the host that accepts. Returns lookup_host if the name is unknown, or connection_timed_out if
/// the connection is refused or not accepted by the deadline; `why` is the system's error text. The socket is non-blocking.
Code connect_to(const std::string& host, const std::string& port, Deadline deadline, Descriptor& out, std::string& why);

/// Waits for an event of the socket; `events` as for poll(). Returns success, timeout (no event by the deadline) or failed.
Code wait_for(int fd, short events, Deadline deadline);

/// Writes all bytes. Returns success, socket_write_timeout, socket_closed (by the peer) or socket_write.
Code send_all(int fd, const Bytes& bytes, Deadline deadline);

/// Appends received bytes, at most `most`. Returns success (perhaps without a byte), socket_closed or socket_read.
Code receive_some(int fd, Bytes& out, std::size_t most);

}  // namespace sonar::bvt
