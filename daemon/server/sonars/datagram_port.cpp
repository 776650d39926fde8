#include "daemon/server/sonars/datagram_port.hpp"

#include <linux/errqueue.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <algorithm>
#include <cstring>
#include <span>
#include <utility>

#include "daemon/server/system/listen.hpp"

namespace sonar {
namespace {

/// Binds a broadcast address, which several sonars in a network share.
bool bind_shared(udp::socket& socket, const udp::endpoint& at) {
  error_code ec;
  socket.open(udp::v4(), ec);
  if (!ec) socket.set_option(asio::socket_base::reuse_address(true), ec);
  if (!ec) socket.bind(at, ec);
  if (ec) socket.close();
  return !ec;
}

/// Returns the broadcast address; on loopback (127.0.0.0/8 with any netmask) it is 127.255.255.255.
Ipv4 broadcast_of(const SonarConfig& sonar) {
  if (sonar.bind_ip[0] == 127) return {127, 255, 255, 255};
  Ipv4 address{};
  for (std::size_t i = 0; i < address.size(); ++i)
    address[i] = static_cast<std::uint8_t>(sonar.bind_ip[i] | static_cast<std::uint8_t>(~sonar.netmask[i]));
  return address;
}

/// True if a socket error is the answer "port unreachable" of a datagram's destination.
bool is_closed_port(msghdr& message) {
  for (const cmsghdr* c = CMSG_FIRSTHDR(&message); c != nullptr; c = CMSG_NXTHDR(&message, const_cast<cmsghdr*>(c))) {
    if (c->cmsg_level != IPPROTO_IP || c->cmsg_type != IP_RECVERR) continue;
    sock_extended_err error{};
    std::memcpy(&error, CMSG_DATA(c), sizeof error);
    if (error.ee_origin == SO_EE_ORIGIN_ICMP && error.ee_errno == ECONNREFUSED) return true;
  }
  return false;
}

}  // namespace

Result<void> DatagramPort::open(const SonarConfig& sonar, std::uint16_t port, bool shared) {
  number_ = port;
  Socket& own = sockets_.emplace_back(io_);
  // If there are `groups`, broadcasts are enabled, because only the system has the list of all broadcast addresses.
  if (auto r = bind_udp(own.socket, {sonar.bind_ip, port}, shared || !sonar.groups.empty(), shared); !r) return r;
  send_multicast_from(own.socket, sonar.bind_ip);
  return {};
}

void DatagramPort::receive_broadcasts(const SonarConfig& sonar) {
  if (sonar.bind_ip == Ipv4{}) return;
  broadcast_ = {address_of(broadcast_of(sonar)), number_};
  for (const Ipv4& broadcast : {broadcast_of(sonar), Ipv4{255, 255, 255, 255}}) {
    if (broadcast == sonar.bind_ip) continue;
    Socket& all = sockets_.emplace_back(io_);
    if (!bind_shared(all.socket, {address_of(broadcast), number_})) sockets_.pop_back();
  }
}

/// Starts to receive. Without functions for answers and errors, the port only sends.
void DatagramPort::start() {
  if (!answer_ && !closed_) return;
  if (closed_) {
    const int on = 1;
    setsockopt(socket().native_handle(), IPPROTO_IP, IP_RECVERR, &on, sizeof on);
  }
  for (Socket& socket : sockets_) receive(socket);
}

/// Reads the error queue of the socket. With IP_RECVERR, an entry for an ICMP answer contains the host.
void DatagramPort::take_errors() {
  while (closed_ && !stopping_) {
    sockaddr_in host{};
    alignas(cmsghdr) std::array<std::byte, 512> more{};
    msghdr message{};
    message.msg_name = &host;
    message.msg_namelen = sizeof host;
    message.msg_control = more.data();
    message.msg_controllen = more.size();
    if (recvmsg(socket().native_handle(), &message, MSG_ERRQUEUE | MSG_DONTWAIT) < 0) return;
    if (!is_closed_port(message)) continue;
    Endpoint closed;
    std::memcpy(closed.ip.data(), &host.sin_addr, closed.ip.size());
    closed.port = ntohs(host.sin_port);
    closed_(closed);
  }
}

void DatagramPort::stop() {
  stopping_ = true;
  error_code ec;
  for (Socket& socket : sockets_) {
    socket.socket.close(ec);
    socket.pause.cancel();
  }
}

/// Answers a datagram from the sonar's own address, so that hosts learn this address. An unreachable host gets no answer. A host
/// of this computer with the same port at all addresses may send from the sonar's address; only a broadcast reaches it. Returns
/// false if the datagram was dropped.
bool DatagramPort::take(Socket& at, std::size_t size) {
  if (!answer_ || !at.from.address().is_v4()) return false;
  const Endpoint from{at.from.address().to_v4().to_bytes(), at.from.port()};
  const auto answers = answer_(from, std::span(at.datagram).first(size));
  if (!answers) return false;
  error_code ignored;
  const bool is_own = broadcast_.port() != 0 && at.from == socket().local_endpoint(ignored);
  for (const protocol::Bytes& answer : *answers)
    socket().send_to(asio::buffer(answer), is_own ? broadcast_ : at.from, 0, ignored);
  return true;
}

/// Receives one datagram and calls itself again, perhaps after a pause, until the socket is closed.
void DatagramPort::receive(Socket& at) {
  at.socket.async_receive_from(asio::buffer(at.datagram), at.from, [this, &at](const error_code& ec, std::size_t size) {
    if (stopping_ || ec == asio::error::operation_aborted) return;
    take_errors();
    const bool taken = !ec && take(at, size);
    const auto pause = rate_.pause_after(taken, DatagramRate::Steady::now());
    if (pause.count() == 0) return receive(at);
    at.pause.expires_after(pause);
    at.pause.async_wait([this, &at](const error_code& ended) {
      if (!ended && !stopping_) receive(at);
    });
  });
}

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
