// Blocking sockets with deadlines, for the client side. They support only IPv4, as the devices do.
#pragma once

#include <netinet/in.h>

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
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
/// Parses "host", "host:port" or ":port"; missing parts are taken from `fallback`.
Result<Endpoint> parse_endpoint(const std::string& text, const Endpoint& fallback);

using Lookup = std::function<Result<in_addr>(const std::string& host)>;
/// Looks up a name in the hosts file and by DNS, which may take many seconds and ignores signals. Error usage: no address.
Result<in_addr> look_up(const std::string& host);
/// Returns the first IPv4 address of a host. A name is looked up in another thread, which is abandoned when `interrupted` is set,
/// or in this one if no thread can be started. Errors: usage (no address), io (interrupted).
Result<sockaddr_in> resolve(const Endpoint& endpoint, const Lookup& lookup = look_up);

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

/// Return the address of our end, or of the other end, of a socket; port 0 if that end has none.
sockaddr_in own_address(const Socket& socket);
sockaddr_in peer_address(const Socket& socket);

/// Retries until `patience` is over, because the daemon may still be starting.
Result<Socket> connect_tcp(const Endpoint& to, std::chrono::milliseconds patience);
struct Connected {
  Socket socket;
  std::size_t which = 0;  // index of the address
};
/// Tries several addresses in turn. Returns the first that accepts.
Result<Connected> connect_first(const std::vector<Endpoint>& places, std::chrono::milliseconds patience);
Result<Socket> connect_udp(const Endpoint& to);
/// Binds with address reuse, so that other listeners on this computer still receive broadcasts.
Result<Socket> listen_udp(const Endpoint& at);
inline Result<Socket> listen_udp(std::uint16_t port) { return listen_udp(Endpoint{"0.0.0.0", port}); }

enum class Wait { data, timed_out, interrupted, closed };
struct Read {
  Wait what = Wait::timed_out;
  std::size_t size = 0;
  std::string error;  // reason, if the connection did not end regularly
};
Read read_some(const Socket& socket, std::span<std::byte> into, std::chrono::milliseconds patience);
/// A datagram and its sender.
struct Datagram {
  Wait what = Wait::timed_out;
  std::size_t size = 0;
  std::uint32_t ip = 0;  // in network order
  std::string error;
};
Datagram receive_from(const Socket& socket, std::span<std::byte> into, std::chrono::milliseconds patience);
/// Waits for the end of a connection without reading. Returns false if a byte arrives on `socket` or one of `others`,
/// or `patience` expires.
bool ends_without_a_byte(const Socket& socket, std::span<const int> others, std::chrono::milliseconds patience);
Result<void> write_all(const Socket& socket, std::span<const std::byte> bytes);

/// Ctrl-C, SIGTERM and SIGHUP set it. Commands then end as at a time-out and make no connections.
extern std::atomic<int> interrupted;
static_assert(std::atomic<int>::is_always_lock_free, "handlers of signals set it");
/// Waits are cut into steps of this length, so that a signal between a check of `interrupted` and the wait is noticed soon.
constexpr std::chrono::milliseconds longest_step{100};

/// The answer to one request over HTTP.
struct HttpReply {
  unsigned status = 0;
  std::string body;
};
/// A body is sent as JSON. Errors: unavailable if there is no connection; bad_data if the answer within `patience` is not HTTP.
Result<HttpReply> http_ask(const Endpoint& at, const std::string& method, const std::string& path, const std::string& body,
                           std::chrono::milliseconds patience);

}  // namespace sonar::clients
