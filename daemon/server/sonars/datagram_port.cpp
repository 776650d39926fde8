#include "daemon/server/sonars/datagram_port.hpp"

#include <linux/errqueue.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <cstring>
#include <span>

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
  if (auto r = bind_udp(own.socket, {sonar.bind_ip, port}, !sonar.groups.empty(), shared); !r) return r;
  send_multicast_from(own.socket, sonar.bind_ip);
  return {};
}

void DatagramPort::receive_broadcasts(const SonarConfig& sonar) {
  if (sonar.bind_ip == Ipv4{}) return;
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

/// Answers a datagram from the sonar's own address, so that hosts learn this address. An unreachable host gets no answer. Returns
/// false if the datagram was dropped.
bool DatagramPort::take(Socket& at, std::size_t size) {
  if (!answer_ || !at.from.address().is_v4()) return false;
  const Endpoint from{at.from.address().to_v4().to_bytes(), at.from.port()};
  const auto answers = answer_(from, std::span(at.datagram).first(size));
  if (!answers) return false;
  error_code ignored;
  for (const protocol::Bytes& answer : *answers) socket().send_to(asio::buffer(answer), at.from, 0, ignored);
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

}  // namespace sonar
