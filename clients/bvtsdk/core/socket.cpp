#include "clients/bvtsdk/core/socket.hpp"

#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <memory>
#include <system_error>

namespace sonar::bvt {
namespace {

int milliseconds_until(Deadline deadline) {
  const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now()).count();
  return static_cast<int>(std::clamp<decltype(left)>(left, 0, 3600000));
}

/// Returns 0, the errno of the failure, or ETIMEDOUT if waiting fails.
int finish_connecting(int fd, const addrinfo& address, Deadline deadline) {
  if (connect(fd, address.ai_addr, address.ai_addrlen) == 0) return 0;
  if (errno != EINPROGRESS) return errno;
  if (wait_for(fd, POLLOUT, deadline) != success) return ETIMEDOUT;
  int error = 0;
  socklen_t size = sizeof error;
  return getsockopt(fd, SOL_SOCKET, SO_ERROR, &error, &size) == 0 ? error : errno;
}

}  // namespace

Descriptor& Descriptor::operator=(Descriptor&& other) noexcept {
  std::swap(fd_, other.fd_);
  return *this;
}

Descriptor::~Descriptor() {
  if (fd_ >= 0) close(fd_);
}

bool split_endpoint(const std::string& endpoint, std::string& host, std::string& port) {
  const std::size_t colon = endpoint.find(':');
  const bool with_port =
      colon != std::string::npos && endpoint.find(':', colon + 1) == std::string::npos;  // several colons: IPv6
  host = with_port ? endpoint.substr(0, colon) : endpoint;
  if (with_port) port = endpoint.substr(colon + 1);
  const bool number = !port.empty() && port.size() <= 5 && port.find_first_not_of("0123456789") == std::string::npos;
  return !host.empty() && number && std::stoi(port) >= 1 && std::stoi(port) <= 65535;
}

Code connect_to(const std::string& host, const std::string& port, Deadline deadline, Descriptor& out, std::string& why) {
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_NUMERICSERV;
  addrinfo* list = nullptr;
  if (const int error = getaddrinfo(host.c_str(), port.c_str(), &hints, &list)) {
    why = gai_strerror(error);
    return lookup_host;
  }
  const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> owner(list, &freeaddrinfo);
  for (const addrinfo* a = list; a; a = a->ai_next) {
    Descriptor fd(socket(a->ai_family, a->ai_socktype | SOCK_NONBLOCK | SOCK_CLOEXEC, a->ai_protocol));
    const int error = fd ? finish_connecting(fd.fd(), *a, deadline) : errno;
    if (error != 0) {
      why = std::generic_category().message(error);
      continue;
    }
    const int on = 1;
    setsockopt(fd.fd(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    out = std::move(fd);
    return success;
  }
  return connection_timed_out;
}

Code wait_for(int fd, short events, Deadline deadline) {
  for (;;) {
    pollfd p{fd, events, 0};
    const int ready = poll(&p, 1, milliseconds_until(deadline));
    if (ready > 0) return success;
    if (ready == 0) return timeout;
    if (errno != EINTR) return failed;
  }
}

Code send_all(int fd, const Bytes& bytes, Deadline deadline) {
  std::size_t sent = 0;
  while (sent < bytes.size()) {
    const ssize_t n = send(fd, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL);
    if (n > 0) {
      sent += static_cast<std::size_t>(n);
    } else if (errno == EAGAIN || errno == EWOULDBLOCK) {
      const Code code = wait_for(fd, POLLOUT, deadline);
      if (code != success) return code == timeout ? socket_write_timeout : socket_write;
    } else if (errno != EINTR) {
      return errno == EPIPE || errno == ECONNRESET ? socket_closed : socket_write;
    }
  }
  return success;
}

Code receive_some(int fd, Bytes& out, std::size_t most) {
  const std::size_t before = out.size();
  out.resize(before + most);
  const ssize_t n = recv(fd, out.data() + before, most, 0);
  const int error = errno;
  out.resize(before + (n > 0 ? static_cast<std::size_t>(n) : 0));
  if (n > 0) return success;
  if (n == 0 || error == ECONNRESET) return socket_closed;
  return error == EAGAIN || error == EWOULDBLOCK || error == EINTR ? success : socket_read;
}

}  // namespace sonar::bvt
