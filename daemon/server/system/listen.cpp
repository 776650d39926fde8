#include "daemon/server/system/listen.hpp"

#include <netinet/tcp.h>
#include <poll.h>

#include <algorithm>
#include <fstream>

namespace sonar {
namespace {

/// Returns the range of ports of outgoing connections; the default of Linux is 32768-60999.
std::pair<int, int> ephemeral_range() {
  std::pair<int, int> range{32768, 60999};
  std::ifstream file("/proc/sys/net/ipv4/ip_local_port_range");
  int low = 0, high = 0;
  if (file >> low >> high) range = {low, high};
  return range;
}

Error explain(const error_code& ec, Endpoint at) {
  std::string text = "cannot listen on " + text_of(at) + ": ";
  if (ec == asio::error::address_in_use) {
    const std::string port = std::to_string(at.port);
    text +=
        "port in use by another program (another sonard? --offset 1, 2, ... starts one beside it; sonard replay needs another "
        "--ip; see: ss "
        "-anp | grep " +
        port + ")";
    const auto [low, high] = ephemeral_range();
    if (at.port >= low && at.port <= high)
      text += "; it lies in the ephemeral range " + std::to_string(low) + "-" + std::to_string(high) +
              ", so an outgoing connection may hold it. Reserve the port: sysctl net.ipv4.ip_local_reserved_ports=" + port;
  } else if (ec.value() == EADDRNOTAVAIL) {
    text += "address not on this host. Add it: ip addr add " + text_of(at.ip) +
            "/24 dev eth0 (or listen on 127.0.0.2: --bind, for a replay --ip)";
  } else if (ec == asio::error::access_denied) {
    const std::string port = std::to_string(at.port);
    text += "ports below 1024 need a right. Give it to all programs: sysctl net.ipv4.ip_unprivileged_port_start=" + port +
            ", or run sonard as root";
  } else {
    text += ec.message();
  }
  return {ErrorKind::unavailable, text};
}

}  // namespace

asio::ip::address_v4 address_of(Ipv4 ip) { return asio::ip::address_v4(ip); }

Result<void> listen_tcp(tcp::acceptor& acceptor, Endpoint at) {
  error_code ec;
  acceptor.open(tcp::v4(), ec);
  if (!ec) acceptor.set_option(asio::socket_base::reuse_address(true), ec);  // needed only for connections in TIME_WAIT
  if (!ec) acceptor.bind({address_of(at.ip), at.port}, ec);
  if (!ec) acceptor.listen(asio::socket_base::max_listen_connections, ec);
  if (ec) return tl::make_unexpected(explain(ec, at));
  return {};
}

void end_when_silent(tcp::socket& socket, std::chrono::milliseconds limit) {
  namespace option = asio::detail::socket_option;
  // There are three probes, the last a second before the limit if possible, because kernel timers tend to be late.
  const auto probe_s =
      static_cast<int>(std::max(std::chrono::floor<std::chrono::seconds>(limit).count() - 1, std::int64_t{3}) / 3);
  error_code ec;  // after a failure, the time-out of the kernel applies: a quarter of an hour or more
  socket.set_option(asio::socket_base::keep_alive(true), ec);
  socket.set_option(option::integer<IPPROTO_TCP, TCP_KEEPIDLE>(probe_s), ec);
  socket.set_option(option::integer<IPPROTO_TCP, TCP_KEEPINTVL>(probe_s), ec);
  socket.set_option(option::integer<IPPROTO_TCP, TCP_KEEPCNT>(2), ec);
  socket.set_option(option::integer<IPPROTO_TCP, TCP_USER_TIMEOUT>(3000 * probe_s), ec);
}

bool has_left(tcp::socket& socket) {
  // POLLRDHUP means that the peer has closed its end, even if unread data is waiting.
  pollfd asked{socket.native_handle(), POLLRDHUP, 0};
  return ::poll(&asked, 1, 0) > 0;
}

Result<void> bind_udp(udp::socket& socket, Endpoint at, bool broadcast, bool shared) {
  error_code ec;
  socket.open(udp::v4(), ec);
  if (!ec && shared) socket.set_option(asio::socket_base::reuse_address(true), ec);
  if (!ec && broadcast) socket.set_option(asio::socket_base::broadcast(true), ec);
  if (!ec) socket.bind({address_of(at.ip), at.port}, ec);
  if (ec) return tl::make_unexpected(explain(ec, at));
  return {};
}

void send_multicast_from(udp::socket& socket, Ipv4 ip) {
  error_code ec;  // after a failure, the system chooses the interface
  if (ip != Ipv4{}) socket.set_option(asio::ip::multicast::outbound_interface(address_of(ip)), ec);
}

bool is_admitted(const std::vector<AddressRange>& allow_from, const asio::ip::address& from) {
  if (!from.is_v4()) return false;
  const Ipv4 ip = from.to_v4().to_bytes();
  if (allow_from.empty()) return is_loopback(ip);
  return std::any_of(allow_from.begin(), allow_from.end(), [&](const AddressRange& r) { return r.contains(ip); });
}

}  // namespace sonar
