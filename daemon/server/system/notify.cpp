#include "daemon/server/system/notify.hpp"

#include <sys/socket.h>
#include <sys/time.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>

#include "core/text/decimal.hpp"

namespace sonar {
namespace {

std::string from_environment(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? "" : value;
}

/// Replaces line breaks, because in the protocol a value is one line.
std::string one_line(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

}  // namespace

NotifyTarget notify_target_from_environment() {
  NotifyTarget target{from_environment("NOTIFY_SOCKET"), {}};
  const std::string pid = from_environment("WATCHDOG_PID");
  const auto period = text::parse_integer(from_environment("WATCHDOG_USEC"));
  if (period && *period > 0 && (pid.empty() || pid == std::to_string(::getpid())))
    target.watchdog = std::chrono::microseconds(*period);
  return target;
}

Notify::Notify(asio::io_context& io, NotifyTarget target, std::function<std::chrono::nanoseconds()> ping_under_way, Log& log)
    : target_(std::move(target)), ping_under_way_(std::move(ping_under_way)), log_(log), timer_(io) {
  if (target_.socket.empty()) return;
  socket_ = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  // A service manager that does not read must not delay sonard noticeably.
  const timeval patience{0, 200000};
  if (socket_ >= 0) ::setsockopt(socket_, SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof patience);
}

Notify::~Notify() {
  if (socket_ >= 0) ::close(socket_);
}

void Notify::ready(const std::string& status) {
  // READY is also sent after a reload, because systemd waits for it after RELOADING. Watchdog messages begin with the first
  // READY.
  send("READY=1\nSTATUS=" + one_line(status), 0);
  if (target_.socket.empty() || target_.watchdog.count() == 0 || stopping_ || std::exchange(keeping_, true)) return;
  keep_alive();
}

void Notify::reloading() {
  const auto now = std::chrono::steady_clock::now().time_since_epoch();
  const auto monotonic = std::chrono::duration_cast<std::chrono::microseconds>(now).count();
  send("RELOADING=1\nMONOTONIC_USEC=" + std::to_string(monotonic) + "\nSTATUS=Reloading", 0);
}

void Notify::stopping() {
  if (std::exchange(stopping_, true)) return;
  send("STOPPING=1\nSTATUS=Stopping", 0);
  timer_.cancel();
}

/// Reports twice per watchdog period, except while a ping takes longer than that period; then the manager restarts sonard.
void Notify::keep_alive() {
  const bool stuck = ping_under_way_() > target_.watchdog;
  if (stuck && !stuck_)
    log_.error("a ping takes longer than the service manager's watchdog; no sign of life until it is done",
               {{"watchdog_s", std::chrono::duration<double>(target_.watchdog).count()}});
  stuck_ = stuck;
  if (!stuck) send("WATCHDOG=1", MSG_DONTWAIT);
  timer_.expires_after(target_.watchdog / 2);
  timer_.async_wait([this](const error_code& ec) {
    if (!ec && !stopping_) keep_alive();
  });
}

void Notify::send(const std::string& message, int flags) {
  if (target_.socket.empty()) return;
  sockaddr_un at{};
  at.sun_family = AF_UNIX;
  std::string why;
  if (target_.socket.size() >= sizeof at.sun_path || (target_.socket[0] != '/' && target_.socket[0] != '@')) {
    why = "not the address of a local socket";
  } else {
    std::copy(target_.socket.begin(), target_.socket.end(), at.sun_path);
    if (at.sun_path[0] == '@') at.sun_path[0] = '\0';  // address in the abstract namespace
    // The length of a file-system address includes the terminating zero; the length of an abstract address does not.
    const bool abstract = at.sun_path[0] == '\0';
    const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + target_.socket.size() + (abstract ? 0 : 1));
    const auto* address = static_cast<const sockaddr*>(static_cast<const void*>(&at));
    const auto sent = ::sendto(socket_, message.data(), message.size(), flags | MSG_NOSIGNAL, address, size);
    if (sent < 0) why = std::strerror(errno);
  }
  if (!why.empty() && !std::exchange(complained_, true))
    log_.warning("cannot notify the service manager at " + target_.socket + " (NOTIFY_SOCKET): " + why);
}

}  // namespace sonar
