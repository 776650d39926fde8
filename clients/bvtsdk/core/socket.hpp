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

/// Splits "host" or "host:port". False when the host is empty or the port is not a number from 1 to 65535.
bool split_endpoint(const std::string& endpoint, std::string& host, std::string& port);

/// Connects to the first address of the host that takes it. lookup_host when the name is unknown, connection_timed_out when
/// the connection is refused, or not accepted by the deadline; `why` is then the system's error text. The socket is non-blocking.
Code connect_to(const std::string& host, const std::string& port, Deadline deadline, Descriptor& out, std::string& why);

/// success, timeout (no event by the deadline), or failed. `events` as for poll().
Code wait_for(int fd, short events, Deadline deadline);

/// success, socket_write_timeout, socket_closed (the peer is gone) or socket_write.
Code send_all(int fd, const Bytes& bytes, Deadline deadline);

/// Appends what has arrived, at most `most` bytes. success (perhaps with nothing), socket_closed or socket_read.
Code receive_some(int fd, Bytes& out, std::size_t most);

}  // namespace sonar::bvt
