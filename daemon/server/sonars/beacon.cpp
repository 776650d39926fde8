#include "daemon/server/sonars/beacon.hpp"

#include <utility>

#include "daemon/server/system/listen.hpp"

namespace sonar {

Result<void> Beacon::open(const SonarConfig& sonar, const protocol::Port& port) {
  period_ = port.period;
  for (const Endpoint& to : sonar.status_to) to_.emplace_back(address_of(to.ip), to.port == 0 ? port.number : to.port);
  // Binds an ephemeral port, but never the port on which drivers listen.
  for (int attempt = 0; attempt < 8; ++attempt) {
    if (socket_.is_open()) socket_.close();
    if (auto r = bind_udp(socket_, {sonar.bind_ip, 0}, true); !r) return r;
    if (socket_.local_endpoint().port() != port.number) break;
  }
  send_multicast_from(socket_, sonar.bind_ip);
  return {};
}

/// If an exception ends send(), start() is called again after one period, or as soon as send_now() is called.
void Beacon::start() {
  if (period_.count() == 0) return;
  asio::co_spawn(
      socket_.get_executor(), [this] { return send(); },
      [this](std::exception_ptr fault) {
        if (!fault || stopping_) return;
        fault_(text_of(fault));
        timer_.expires_after(period_);
        timer_.async_wait([this](const error_code&) {  // send_now() cancels this wait
          if (!stopping_) start();
        });
      });
}

void Beacon::stop() {
  stopping_ = true;
  error_code ec;
  timer_.cancel();
  socket_.close(ec);
}

asio::awaitable<void> Beacon::send() {
  while (!stopping_) {
    timer_.expires_after(period_);  // set before making the bytes, so that a send_now() during the write is not lost
    sent_at_ = std::chrono::steady_clock::now();
    const std::vector<protocol::Bytes> datagrams = make_();
    for (const protocol::Bytes& status : datagrams)
      for (const udp::endpoint& to : to_) {
        error_code ec;
        co_await socket_.async_send_to(asio::buffer(status), to, into(ec));
        if (stopping_) co_return;
        if (ec && !std::exchange(failed_, true))
          log_.warning("cannot send status: " + ec.message(), {{"sonar", sonar_}, {"to", to.address().to_string()}});
      }
    error_code ec;
    co_await timer_.async_wait(into(ec));
  }
}

}  // namespace sonar
