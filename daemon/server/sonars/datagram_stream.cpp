#include "daemon/server/sonars/datagram_stream.hpp"

#include <algorithm>
#include <utility>

#include "daemon/server/system/listen.hpp"

namespace sonar {

void DatagramStream::start() {
  const auto self = shared_from_this();
  asio::co_spawn(
      socket_.get_executor(), [self] { return self->send(); },
      [self](std::exception_ptr fault) {
        if (fault) self->parent_.on_fault(text_of(fault));
        self->parent_.on_over(self->id_, fault ? "an internal fault" : self->why_, !fault && self->by_host_);
      });
}

void DatagramStream::finish(std::string why, bool by_host) {
  if (std::exchange(finishing_, true)) return;
  why_ = std::move(why);
  by_host_ = by_host;
  parent_.on_finish(id_);
  wake_.cancel();
}

asio::awaitable<void> DatagramStream::send() {
  const auto self = shared_from_this();
  while (true) {
    if (const Outbox::Message message = parent_.next_message(id_)) {
      auto receivers = parent_.receivers(id_);  // the same list for the whole message
      if (receivers.empty()) {
        parent_.on_not_sent(id_);
        continue;
      }
      if (!co_await send_message(message, std::move(receivers))) co_return;
      parent_.on_written(id_, message);
    } else if (finishing_) {
      co_return;
    } else {
      co_await wait();
    }
  }
}

/// Sends an empty datagram, which has no effect on a host, but which a closed port answers with ICMP.
void DatagramStream::send_nothing_to(const Endpoint& to) {
  error_code ignored;
  socket_.send_to(asio::const_buffer(), {address_of(to.ip), to.port}, 0, ignored);
}

/// Waits for the next message. In the second half of the permitted silence, the host is probed four times, because an answer
/// can be lost; then the stream ends. After a delay of the daemon, the host is probed before the stream ends.
asio::awaitable<void> DatagramStream::wait() {
  constexpr int most_looks = 4;
  const auto longest = parent_.longest_silence(id_);
  auto next_look = asio::steady_timer::time_point::max();
  if (longest) next_look = looks_ == 0 ? heard_at_ + *longest / 2 : looked_at_ + *longest / (2 * most_looks);
  wake_.expires_at(next_look);
  error_code ec;
  co_await wake_.async_wait(into(ec));
  if (ec || !longest) co_return;
  if (looks_ == most_looks) {
    finish("silent for " + std::to_string(longest->count() / 1000) + " s");
    co_return;
  }
  ++looks_;
  looked_at_ = std::chrono::steady_clock::now();
  parent_.look_for_host(id_);
}

/// Returns false if the socket was closed before the whole message was sent. A receiver that is removed meanwhile gets no more
/// parts.
asio::awaitable<bool> DatagramStream::send_message(const Outbox::Message& message, std::vector<Endpoint> receivers) {
  if (message.datagrams == nullptr) co_return co_await send_datagram(*message.bytes, receivers);
  for (std::size_t i = 0; i < message.datagrams->size(); ++i) {
    if (i > 0 && gap_.count() > 0) {
      error_code ec;
      pause_.expires_after(gap_);
      co_await pause_.async_wait(into(ec));
      if (!socket_.is_open()) co_return false;
    }
    if (i > 0) {
      const auto now = parent_.receivers(id_);
      std::erase_if(receivers, [&](const Endpoint& to) { return std::find(now.begin(), now.end(), to) == now.end(); });
    }
    if (!co_await send_datagram((*message.datagrams)[i], receivers)) co_return false;
  }
  co_return true;
}

asio::awaitable<bool> DatagramStream::send_datagram(const protocol::Bytes& datagram, const std::vector<Endpoint>& receivers) {
  for (const Endpoint& to : receivers) {
    error_code ec;
    const auto sent_to = udp::endpoint(address_of(to.ip), to.port);
    co_await socket_.async_send_to(asio::buffer(datagram), sent_to, into(ec));
    // The error belongs to an earlier datagram, perhaps to another host; this datagram was not sent.
    if (ec == asio::error::connection_refused) co_await socket_.async_send_to(asio::buffer(datagram), sent_to, into(ec));
    if (!socket_.is_open()) co_return false;
    if (ec)
      parent_.on_send_error(to, ec.message());
    else
      parent_.on_sent(id_, datagram.size());
  }
  co_return true;
}

}  // namespace sonar
