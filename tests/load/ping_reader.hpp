// Reads many sockets in one thread, as drivers do, and compares every ping with the ping that the engine made.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace sonar::load {

using Steady = std::chrono::steady_clock;

/// A connected TCP socket; the destructor closes it. fd() is -1 if no program listens.
class Socket {
 public:
  Socket(const std::string& address, std::uint16_t port, int receive_buffer = 0);
  ~Socket() { close(); }
  Socket(Socket&& o) noexcept : fd_(o.fd_) { o.fd_ = -1; }
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;
  Socket& operator=(Socket&&) = delete;

  int fd() const { return fd_; }
  /// Sends bytes. Returns false if the other end does not receive them in time.
  bool send(const std::vector<std::byte>& bytes, std::chrono::milliseconds patience = std::chrono::seconds(20));
  /// Waits for bytes and returns their number; -1 at the time limit or after an error, 0 at the end of the stream.
  long receive(std::byte* into, std::size_t size, std::chrono::milliseconds patience);
  void close();
  void reset();          // closes with an RST instead of a FIN
  void die();            // from now on like a computer without power: neither receives nor answers
  void close_one_way();  // sends a FIN, and the other direction stays open

 private:
  int fd_ = -1;
};

/// Returns the request of an unmodified driver: mode 2, 2 m, 256 beams of 8 bit. `hz` 0 is standby; other values give the next
/// existing rate.
std::vector<std::byte> fire(int hz = 40);

/// Splits a stream into messages in a buffer of fixed size and checks each.
class PingReader {
 public:
  explicit PingReader(Socket socket) : socket_(std::move(socket)) {}
  Socket& socket() { return socket_; }
  /// Reads the received bytes. Returns false if the stream has ended.
  bool read_some();

  std::uint64_t pings = 0, garbled = 0;  // garbled: pings with wrong content or order, and invalid messages
  std::uint64_t ids_skipped = 0;         // ids that are missing between pings of this stream
  std::uint32_t last_id = 0;
  bool ended = false, was_reset = false;
  Steady::time_point last_at{};
  std::chrono::duration<double> longest_gap{0};
  bool cut() const { return filled_ > 0; }  // a part of a message is left

 private:
  void take_message(std::size_t size);

  Socket socket_;
  std::vector<std::byte> buffer_ = std::vector<std::byte>(std::size_t{1} << 18);
  std::size_t filled_ = 0;
};

/// Reads all sockets until `until`, or until all streams have ended.
void read_all(std::vector<std::unique_ptr<PingReader>>& readers, Steady::time_point until);

}  // namespace sonar::load
