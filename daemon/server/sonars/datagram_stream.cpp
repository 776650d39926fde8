#include "daemon/server/sonars/datagram_stream.hpp"

#include <utility>

#include "daemon/server/system/listen.hpp"

namespace sonar {

void DatagramStream::start() {
  const auto self = shared_from_this();
  asio::co_spawn(
      socket_.get_executor(), [self] { return self->send(); },
      [self](std::exception_ptr fault) {
        if (fault) self->parent_.on_fault(text_of(fault));
        self->parent_.on_over(self->id_, fault ? "an internal fault" : self->why_);
      });
}

void DatagramStream::finish(std::string why) {
  if (std::exchange(finishing_, true)) return;
  why_ = std::move(why);
  parent_.on_finish(id_);
  wake_.cancel();
}

asio::awaitable<void> DatagramStream::send() {
  const auto self = shared_from_this();
  while (true) {
    if (const Outbox::Message ping = parent_.next_message(id_)) {
      const auto receivers = parent_.receivers(id_);  // one list for the whole ping
      if (receivers.empty()) {
        parent_.on_not_sent(id_);
        continue;
      }
      if (!co_await send_ping(ping, receivers)) co_return;
      parent_.on_written(id_, ping);
    } else if (finishing_) {
      co_return;
    } else {
      error_code ec;
      wake_.expires_at(asio::steady_timer::time_point::max());
      co_await wake_.async_wait(into(ec));
    }
  }
}

/// False: the socket was closed before the ping was whole.
asio::awaitable<bool> DatagramStream::send_ping(const Outbox::Message& ping, const std::vector<Endpoint>& receivers) {
  for (std::size_t i = 0; i < ping.datagrams->size(); ++i) {
    const protocol::Bytes& datagram = (*ping.datagrams)[i];
    error_code ec;
    if (i > 0 && gap_.count() > 0) {
      pause_.expires_after(gap_);
      co_await pause_.async_wait(into(ec));
      if (!socket_.is_open()) co_return false;
    }
    for (const Endpoint& to : receivers) {
      ec = {};
      co_await socket_.async_send_to(asio::buffer(datagram), udp::endpoint(address_of(to.ip), to.port), into(ec));
      if (!socket_.is_open()) co_return false;
      if (ec)
        parent_.on_send_error(to, ec.message());
      else
        parent_.on_sent(id_, datagram.size());
    }
  }
  co_return true;
}

}  // namespace sonar
