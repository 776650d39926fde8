// Opens listeners. Errors state the failure, the place, the cause and the remedy (docs/architecture.md, "Errors").
#pragma once

#include <chrono>

#include "core/base/result.hpp"
#include "daemon/config/addresses.hpp"
#include "daemon/server/system/asio.hpp"

namespace sonar {

Result<void> listen_tcp(tcp::acceptor& acceptor, Endpoint at);
/// Binds a socket. `broadcast`: it may send to broadcast addresses. `shared`: other programs of this computer that also set
/// SO_REUSEADDR may bind the same port at all addresses.
Result<void> bind_udp(udp::socket& socket, Endpoint at, bool broadcast, bool shared = false);

/// Sends multicast over the network interface with this address; with 0.0.0.0 the system chooses the interface.
void send_multicast_from(udp::socket& socket, Ipv4 ip);

/// Ends a connection with asio::error::timed_out if the peer acknowledges no bytes (or, without traffic, no probes) for `limit`,
/// which is rounded to whole seconds, at least 3.
void end_when_silent(tcp::socket& socket, std::chrono::milliseconds limit);

/// Returns whether the peer has closed the connection. Bytes that the peer sent before may still be unread.
bool has_left(tcp::socket& socket);

/// True if poses from an address are accepted. Without ranges only addresses of this computer are, because a reload may remove
/// the ranges while the listener stays open.
bool is_admitted(const std::vector<AddressRange>& allow_from, const asio::ip::address& from);

asio::ip::address_v4 address_of(Ipv4 ip);

}  // namespace sonar
