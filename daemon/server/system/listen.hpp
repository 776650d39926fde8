// Opening listeners with errors that say what, where, why and what to do next (docs/architecture.md, "Errors").
#pragma once

#include <chrono>

#include "core/base/result.hpp"
#include "daemon/config/addresses.hpp"
#include "daemon/server/system/asio.hpp"

namespace sonar {

Result<void> listen_tcp(tcp::acceptor& acceptor, Endpoint at);
/// `broadcast`: may send to broadcast addresses. `shared`: programs of this computer that share too may have the same port at all
/// addresses.
Result<void> bind_udp(udp::socket& socket, Endpoint at, bool broadcast, bool shared = false);

/// Multicast leaves by the network interface of that address; 0.0.0.0: by the system's choice.
void send_multicast_from(udp::socket& socket, Ipv4 ip);

/// If the peer answers neither our bytes nor, while there are none, probes, the connection ends within `limit` with
/// asio::error::timed_out. Whole seconds; at least 3.
void end_when_silent(tcp::socket& socket, std::chrono::milliseconds limit);

/// Whether the peer has closed the connection. Bytes that it sent before may still be unread.
bool has_left(tcp::socket& socket);

/// Whether poses from an address are accepted. Without ranges only those of this computer are: a reload may remove the ranges
/// while the listener stays.
bool is_admitted(const std::vector<AddressRange>& allow_from, const asio::ip::address& from);

asio::ip::address_v4 address_of(Ipv4 ip);

}  // namespace sonar
