#include "daemon/server/connections/admission.hpp"

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>

namespace sonar {
namespace {

constexpr auto accept_pause = std::chrono::milliseconds(100);  // pause after a failed accept
constexpr auto spell = std::chrono::seconds(60);               // after this time without a refusal, the next refusal is logged

constexpr std::uint64_t most_kept_for_drivers = 64;

int open_reserve() { return ::open("/dev/null", O_RDONLY | O_CLOEXEC); }

/// Reads the received bytes first, because closing a socket with unread bytes would send RST, not FIN.
void close_politely(int descriptor) {
  std::array<char, 4096> dustbin;
  for (int reads = 0; reads < 16 && ::recv(descriptor, dustbin.data(), dustbin.size(), MSG_DONTWAIT) > 0; ++reads) {
  }
  ::shutdown(descriptor, SHUT_WR);
}

std::uint64_t most_descriptors() {
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return ~std::uint64_t{0};
  return static_cast<std::uint64_t>(limit.rlim_cur);
}

/// Returns the number of spare descriptors, at most half of all.
std::uint64_t spare_of(const LimitConfig& limits) {
  return std::min(static_cast<std::uint64_t>(limits.spare_descriptors), most_descriptors() / 2);
}

/// Returns the first descriptor number that this purpose may not use. The kernel assigns the lowest free number.
std::uint64_t first_spare(const LimitConfig& limits, Admission::Purpose purpose) {
  const std::uint64_t most = most_descriptors(), spare = spare_of(limits);
  return most - (purpose == Admission::Purpose::control ? spare / 2 : spare);
}

std::uint64_t number_of(const tcp::socket& socket) {
  return static_cast<std::uint64_t>(const_cast<tcp::socket&>(socket).native_handle());
}

}  // namespace

void raise_descriptor_limit() {
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0 || limit.rlim_cur == limit.rlim_max) return;
  limit.rlim_cur = limit.rlim_max;
  setrlimit(RLIMIT_NOFILE, &limit);  // on failure the limit stays lower, and clients are refused sooner
}

void close_politely(tcp::socket& socket) {
  close_politely(socket.native_handle());
  error_code ec;
  socket.close(ec);
}

void close_by_reset(tcp::socket& socket) {
  error_code ec;
  socket.set_option(asio::socket_base::linger(true, 0), ec);
  socket.close(ec);
}

Admission::Admission(const LimitConfig& limits, Log& log) : limits_(limits), log_(log), reserve_(open_reserve()) {
  const std::uint64_t most = most_descriptors(), spare = spare_of(limits);
  if (spare < static_cast<std::uint64_t>(limits.spare_descriptors))
    log_.warning(
        "limits.spare_descriptors is more than half of this process's descriptors: lower it, or raise LimitNOFILE or ulimit -n",
        {{"descriptors", most}, {"spare", spare}});
}

Admission::~Admission() {
  if (reserve_ >= 0) ::close(reserve_);
}

/// Logs the first of a series of refusals. A series ends after a minute without one.
void Admission::log_first(Steady::time_point& last, const char* what) {
  const auto now = Steady::now();
  if (last == Steady::time_point{} || now - last > spell) log_.warning(what, {{"connected", *count_}});
  last = now;
}

bool Admission::leaves_spare(const tcp::socket& socket, Purpose purpose) {
  // All descriptors below that of a new socket are in use, so its number is the count of used descriptors.
  if (number_of(socket) < first_spare(limits_, purpose)) return true;
  ++for_descriptors_;
  log_first(descriptors_logged_,
            "file descriptors run out: refusing clients until some are free (raise LimitNOFILE or ulimit -n)");
  return false;
}

/// True for the descriptors that are kept for drivers, and for higher ones.
bool Admission::is_drivers(const tcp::socket& socket) const {
  const std::uint64_t for_drivers = std::min(most_kept_for_drivers, most_descriptors() / 8);
  return number_of(socket) >= first_spare(limits_, Purpose::client) - for_drivers;
}

/// Returns a slot, which is in use while a copy of it exists, even after the end of this object.
Admission::Place Admission::enter(const tcp::socket& socket) {
  if (!leaves_spare(socket, Purpose::client)) return {};
  if (*count_ >= static_cast<std::uint64_t>(limits_.clients)) {
    ++for_places_;
    log_first(slots_logged_, "no connection slot free: refusing clients until one is (limits.clients)");
    return {};
  }
  ++*count_;
  return {count_.get(), [count = count_](const void*) { --*count; }};
}

asio::awaitable<std::optional<tcp::socket>> Admission::accept(tcp::acceptor& acceptor) {
  while (true) {
    error_code ec;
    tcp::socket socket = co_await acceptor.async_accept(into(ec));
    if (!acceptor.is_open()) co_return std::nullopt;
    if (!ec) co_return std::move(socket);
    if (send_away(acceptor, ec)) continue;
    asio::steady_timer pause(acceptor.get_executor(), accept_pause);
    co_await pause.async_wait(into(ec));
  }
}

asio::awaitable<std::optional<tcp::socket>> Admission::next_visitor(tcp::acceptor& acceptor, Purpose purpose) {
  while (auto socket = co_await accept(acceptor)) {
    if (leaves_spare(*socket, purpose)) co_return socket;
    close_politely(*socket);
  }
  co_return std::nullopt;
}

bool Admission::send_away(tcp::acceptor& acceptor, const error_code& why) {
  if (why.value() != EMFILE && why.value() != ENFILE) return false;
  // Without a free descriptor accept() fails and the client waits in the backlog. So the reserved descriptor is closed for a
  // moment, to accept and close the connection of the client.
  if (reserve_ >= 0) ::close(reserve_);
  const int visitor = ::accept4(acceptor.native_handle(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
  if (visitor >= 0) {
    ++for_descriptors_;
    close_politely(visitor);
    ::close(visitor);
  }
  reserve_ = open_reserve();
  log_first(descriptors_logged_,
            "file descriptors have run out: refusing clients until some are free (raise LimitNOFILE or ulimit -n)");
  return visitor >= 0;
}

}  // namespace sonar
