#include "clients/sonarctl/net.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netdb.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <csignal>
#include <cstring>
#include <future>
#include <memory>
#include <system_error>
#include <thread>

namespace sonar::clients {

std::atomic<int> interrupted = 0;

namespace {

constexpr std::size_t longest_answer = 65536;

/// The socket interface requires this cast.
const sockaddr* generic(const sockaddr_in& address) { return reinterpret_cast<const sockaddr*>(&address); }

/// Runs a task in a thread that gets no signals, so that they interrupt the waits of this thread. If no thread can be started,
/// it runs the task in this one.
void run_without_signals(std::packaged_task<Result<in_addr>()> task) {
  const auto shared = std::make_shared<decltype(task)>(std::move(task));  // a thread that fails to start destroys its argument
  sigset_t all, before;
  sigfillset(&all);
  pthread_sigmask(SIG_BLOCK, &all, &before);
  bool is_started = true;
  try {
    std::thread([shared] { (*shared)(); }).detach();
  } catch (const std::system_error&) {  // the limit of threads (ulimit -u) or of memory (ulimit -v)
    is_started = false;
  }
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
  if (!is_started) (*shared)();
}

Result<Socket> open_socket(int type) {
  Socket socket(::socket(AF_INET, type | SOCK_CLOEXEC, 0));
  if (socket.fd() < 0) return failure(ErrorKind::io, std::string("cannot open a socket: ") + std::strerror(errno));
  return socket;
}

/// When no program listens on a port of the ephemeral range, the system may choose that port for our end: TCP then connects the
/// socket to itself.
bool is_connected_to_itself(const Socket& socket) {
  const sockaddr_in ours = own_address(socket), theirs = peer_address(socket);
  return ours.sin_port != 0 && ours.sin_port == theirs.sin_port && ours.sin_addr.s_addr == theirs.sin_addr.s_addr;
}

/// Tries to connect once, for at most `patience`. Returns 0 or the errno.
int try_connect(const Socket& socket, const sockaddr_in& address, std::chrono::milliseconds patience) {
  const int flags = ::fcntl(socket.fd(), F_GETFL);
  ::fcntl(socket.fd(), F_SETFL, flags | O_NONBLOCK);
  int error = ::connect(socket.fd(), generic(address), sizeof address) == 0 ? 0 : errno;
  if (error == EINPROGRESS) {
    pollfd ready{socket.fd(), POLLOUT, 0};
    socklen_t size = sizeof error;
    int polled = 0;
    for (; polled == 0 && patience.count() > 0 && interrupted == 0; patience -= longest_step)
      polled = ::poll(&ready, 1, static_cast<int>(std::min(patience, longest_step).count()));
    if (polled != 1) return ETIMEDOUT;
    ::getsockopt(socket.fd(), SOL_SOCKET, SO_ERROR, &error, &size);
  }
  ::fcntl(socket.fd(), F_SETFL, flags);
  return error == 0 && is_connected_to_itself(socket) ? ECONNREFUSED : error;
}

}  // namespace

Socket::~Socket() {
  if (fd_ >= 0) ::close(fd_);
}

sockaddr_in own_address(const Socket& socket) {
  sockaddr_in at{};
  socklen_t size = sizeof at;
  ::getsockname(socket.fd(), reinterpret_cast<sockaddr*>(&at), &size);
  return at;
}

sockaddr_in peer_address(const Socket& socket) {
  sockaddr_in at{};
  socklen_t size = sizeof at;
  ::getpeername(socket.fd(), reinterpret_cast<sockaddr*>(&at), &size);
  return at;
}

std::string text_from(const Endpoint& endpoint) { return endpoint.host + ":" + std::to_string(endpoint.port); }

Result<Endpoint> parse_endpoint(const std::string& text, const Endpoint& fallback) {
  Endpoint endpoint = fallback;
  const std::size_t colon = text.rfind(':');
  if (colon != 0 && !text.empty()) endpoint.host = text.substr(0, colon);
  if (colon == std::string::npos) return endpoint;
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data() + colon + 1, end, endpoint.port);
  if (error != std::errc{} || stop != end || endpoint.port == 0)
    return failure(ErrorKind::usage, "\"" + text + "\" is not an address: write HOST:PORT with a port from 1 to 65535");
  return endpoint;
}

Result<in_addr> look_up(const std::string& host) {
  addrinfo hints{};
  hints.ai_family = AF_INET;
  hints.ai_socktype = SOCK_STREAM;  // one element for each address
  addrinfo* list = nullptr;
  const int rc = ::getaddrinfo(host.c_str(), nullptr, &hints, &list);
  const std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)> found(list, &::freeaddrinfo);
  if (rc != 0)
    return failure(ErrorKind::usage,
                   "no address for \"" + host + "\": " + ::gai_strerror(rc) + "; give an IPv4 address such as 127.0.0.2");
  sockaddr_in address{};
  std::memcpy(&address, found->ai_addr, sizeof address);
  return address.sin_addr;
}

Result<sockaddr_in> resolve(const Endpoint& endpoint, const Lookup& lookup) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(endpoint.port);
  if (::inet_pton(AF_INET, endpoint.host.c_str(), &address.sin_addr) == 1) return address;
  std::packaged_task<Result<in_addr>()> task([lookup, host = endpoint.host] { return lookup(host); });
  auto found = task.get_future();
  run_without_signals(std::move(task));
  while (found.wait_for(longest_step) != std::future_status::ready)
    if (interrupted != 0) return failure(ErrorKind::io, "interrupted before the address of " + endpoint.host + " was found");
  const Result<in_addr> ip = found.get();
  if (!ip) return tl::unexpected(ip.error());
  address.sin_addr = *ip;
  return address;
}

Result<Socket> connect_tcp(const Endpoint& to, std::chrono::milliseconds patience) {
  auto connected = connect_first({to}, patience);
  if (!connected) return tl::unexpected(connected.error());
  return std::move(connected->socket);
}

Result<Connected> connect_first(const std::vector<Endpoint>& places, std::chrono::milliseconds patience) {
  using namespace std::chrono_literals;
  const auto deadline = std::chrono::steady_clock::now() + patience;
  std::vector<sockaddr_in> addresses;
  std::string names;
  for (const Endpoint& place : places) {
    const auto found = resolve(place);
    if (!found) return tl::unexpected(found.error());
    addresses.push_back(*found);
    names += (names.empty() ? "" : " or ") + text_from(place);
  }
  for (;;) {
    int error = 0;
    for (std::size_t i = 0; i < places.size(); ++i) {
      if (interrupted != 0) return failure(ErrorKind::io, "interrupted before tcp " + names + " accepted a connection");
      auto socket = open_socket(SOCK_STREAM);
      if (!socket) return tl::unexpected(socket.error());
      const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now());
      error = try_connect(*socket, addresses[i],
                          std::max<std::chrono::milliseconds>(left / static_cast<int>(places.size() - i), 100ms));
      if (error != 0) continue;
      const int yes = 1;
      ::setsockopt(socket->fd(), IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
      return Connected{std::move(*socket), i};
    }
    if (std::chrono::steady_clock::now() + 10ms >= deadline)
      return failure(ErrorKind::unavailable, "cannot connect to tcp " + names + ": " + std::strerror(error) +
                                                 ". Is sonard running there? Its banner names the address of each sonar");
    std::this_thread::sleep_for(5ms);
  }
}

Result<Socket> connect_udp(const Endpoint& to) {
  const auto address = resolve(to);
  if (!address) return tl::unexpected(address.error());
  auto socket = open_socket(SOCK_DGRAM);
  if (socket && ::connect(socket->fd(), generic(*address), sizeof *address) != 0)
    return failure(ErrorKind::unavailable, "cannot send to udp " + text_from(to) + ": " + std::strerror(errno));
  return socket;
}

Result<Socket> listen_udp(const Endpoint& at) {
  auto socket = open_socket(SOCK_DGRAM);
  if (!socket) return socket;
  const int yes = 1;
  ::setsockopt(socket->fd(), SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  const auto place = resolve(at);
  if (!place) return tl::unexpected(place.error());
  if (::bind(socket->fd(), generic(*place), sizeof *place) != 0)
    return failure(ErrorKind::unavailable,
                   "cannot listen on udp " + std::to_string(at.port) + ": " + std::strerror(errno) +
                       ". A driver without address reuse may hold it: stop it, or give the address instead");
  return socket;
}

Read read_some(const Socket& socket, std::span<std::byte> into, std::chrono::milliseconds patience) {
  pollfd ready{socket.fd(), POLLIN, 0};
  const int polled = ::poll(&ready, 1, static_cast<int>(std::max<std::int64_t>(0, patience.count())));
  if (polled == 0) return {Wait::timed_out, 0, {}};
  if (polled < 0) return errno == EINTR ? Read{Wait::interrupted, 0, {}} : Read{Wait::closed, 0, std::strerror(errno)};
  const ssize_t size = ::recv(socket.fd(), into.data(), into.size(), 0);
  if (size > 0) return {Wait::data, static_cast<std::size_t>(size), {}};
  if (size < 0 && errno == EINTR) return {Wait::interrupted, 0, {}};
  return {Wait::closed, 0, size < 0 ? std::strerror(errno) : ""};
}

Datagram receive_from(const Socket& socket, std::span<std::byte> into, std::chrono::milliseconds patience) {
  pollfd ready{socket.fd(), POLLIN, 0};
  const int polled = ::poll(&ready, 1, static_cast<int>(std::max<std::int64_t>(0, patience.count())));
  if (polled == 0) return {Wait::timed_out, 0, 0, {}};
  sockaddr_in from{};
  socklen_t length = sizeof from;
  const ssize_t size =
      polled < 0 ? -1
                 : ::recvfrom(socket.fd(), into.data(), into.size(), MSG_DONTWAIT, reinterpret_cast<sockaddr*>(&from), &length);
  if (size >= 0) return {Wait::data, static_cast<std::size_t>(size), from.sin_addr.s_addr, {}};
  if (errno == EAGAIN) return {Wait::timed_out, 0, 0, {}};  // the datagram's checksum was wrong
  if (errno == EINTR) return {Wait::interrupted, 0, 0, {}};
  return {Wait::closed, 0, 0, std::strerror(errno)};
}

bool ends_without_a_byte(const Socket& socket, std::span<const int> others, std::chrono::milliseconds patience) {
  std::vector<pollfd> ready{{socket.fd(), POLLIN, 0}};
  for (const int other : others) ready.push_back({other, POLLIN, 0});
  std::byte first{};
  return ::poll(ready.data(), ready.size(), static_cast<int>(patience.count())) > 0 && ready.front().revents != 0 &&
         ::recv(socket.fd(), &first, 1, MSG_PEEK) <= 0;
}

Result<void> write_all(const Socket& socket, std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t size = ::send(socket.fd(), bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (size < 0 && errno == EINTR) continue;
    if (size < 0) return failure(ErrorKind::io, std::string("cannot send over the connection: ") + std::strerror(errno));
    bytes = bytes.subspan(static_cast<std::size_t>(size));
  }
  return {};
}

Result<HttpReply> http_ask(const Endpoint& at, const std::string& method, const std::string& path, const std::string& body,
                           std::chrono::milliseconds patience) {
  const auto deadline = std::chrono::steady_clock::now() + patience;
  const auto socket = connect_tcp(at, patience);
  if (!socket) return tl::unexpected(socket.error());
  std::string request = method + " " + path + " HTTP/1.0\r\nHost: " + text_from(at) +
                        "\r\nConnection: close\r\n";  // HTTP/1.0 has no chunked answers
  if (!body.empty()) request += "Content-Type: application/json\r\nContent-Length: " + std::to_string(body.size()) + "\r\n";
  request += "\r\n" + body;
  if (auto sent = write_all(*socket, std::as_bytes(std::span(request.data(), request.size()))); !sent)
    return tl::unexpected(sent.error());
  std::string answer;
  std::array<std::byte, 4096> chunk;
  while (answer.size() < longest_answer) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now());
    const Read read = read_some(*socket, chunk, std::clamp(left, std::chrono::milliseconds(0), longest_step));
    if (read.what == Wait::timed_out && left.count() > 0 && interrupted == 0) continue;
    if (read.what != Wait::data) break;
    for (std::size_t i = 0; i < read.size; ++i) answer += static_cast<char>(chunk[i]);
  }
  HttpReply reply;
  if (answer.starts_with("HTTP/1.") && answer.size() > 12) std::from_chars(answer.data() + 9, answer.data() + 12, reply.status);
  const std::size_t end = answer.find("\r\n\r\n");
  if (reply.status == 0 || end == std::string::npos)
    return failure(ErrorKind::bad_data, "no HTTP answer came from tcp " + text_from(at));
  reply.body = answer.substr(end + 4);
  return reply;
}

}  // namespace sonar::clients
