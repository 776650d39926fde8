#include "daemon/server/connections/listener.hpp"

#include <utility>

#include "daemon/server/system/listen.hpp"

namespace sonar {
namespace {

constexpr auto retry_period = std::chrono::milliseconds(50);

}  // namespace

Result<void> Listener::open(Endpoint at) {
  error_code ec;
  if (auto r = listen_tcp(acceptor_, at); !r) {
    acceptor_.close(ec);
    return r;
  }
  at_ = {at.ip, acceptor_.local_endpoint(ec).port()};
  return {};
}

void Listener::start(Take take, Fault fault) {
  take_ = std::move(take);
  fault_ = std::move(fault);
  if (!acceptor_.is_open()) return;
  keep_running(
      acceptor_.get_executor(), [this] { return accept(); },
      [this](const std::string& text) {
        if (!stopping_) fault_(text);
        return !stopping_;
      });
}

void Listener::stop() {
  stopping_ = true;
  error_code ec;
  acceptor_.close(ec);
  reopen_timer_.cancel();
}

/// Closes the socket, so that the kernel refuses connections. The accept loop then waits in reopen().
void Listener::pause() {
  if (at_.port == 0 || stopping_) return;
  paused_ = true;
  error_code ec;
  acceptor_.close(ec);
}

/// Opens the port at once if it is free; reopen() retries if another program has taken it.
void Listener::resume(Fault taken) {
  if (!std::exchange(paused_, false) || stopping_) return;
  taken_ = std::move(taken);
  try_to_open();
  reopen_timer_.cancel();
}

void Listener::try_to_open() {
  const Result<void> opened = listen_tcp(acceptor_, at_);
  if (opened) return;
  error_code ec;
  acceptor_.close(ec);
  if (const Fault taken = std::exchange(taken_, nullptr)) taken(opened.error().text);
}

/// Waits while the port is closed; the accept loop calls it.
asio::awaitable<void> Listener::reopen() {
  while (!stopping_ && !acceptor_.is_open()) {
    if (paused_)
      reopen_timer_.expires_at(never);
    else
      reopen_timer_.expires_after(retry_period);
    error_code ec;
    co_await reopen_timer_.async_wait(into(ec));
    if (!ec && !stopping_ && !paused_ && !acceptor_.is_open()) try_to_open();
  }
}

asio::awaitable<void> Listener::accept() {
  while (!stopping_) {
    std::optional<tcp::socket> socket;
    if (purpose_)
      socket = co_await admission_.next_visitor(acceptor_, *purpose_);
    else
      socket = co_await admission_.accept(acceptor_);
    if (stopping_) co_return;
    if (socket)
      take_(*std::move(socket));
    else
      co_await reopen();
  }
}

}  // namespace sonar
