// Extracts the TCP segment or UDP datagram of a captured packet. Second step of reading a capture; tcp_stream.hpp orders
// segments.
#pragma once

#include <compare>
#include <cstdint>
#include <optional>
#include <string>

#include "protocol/wire/wire.hpp"

namespace sonar::recording {

struct IpEnd {
  std::uint32_t address = 0;  // 127.0.0.2 = 0x7F000002
  std::uint16_t port = 0;
  auto operator<=>(const IpEnd&) const = default;
};
std::string text_of(const IpEnd& end);  // "127.0.0.2:52100"

namespace tcp_flag {
inline constexpr std::uint8_t fin = 0x01, syn = 0x02, rst = 0x04, psh = 0x08, ack = 0x10;
}

struct Segment {
  bool tcp = true;  // if false: UDP
  IpEnd source, target;
  std::uint32_t sequence = 0;
  std::uint8_t flags = 0;
  wire::BytesView payload;  // as far as it was captured
};

/// Link types Ethernet (with VLAN tags), raw IP, Linux cooked 1 and 2, BSD loopback. nullopt for other packets: other protocols,
/// IPv6, fragments, cut headers.
std::optional<Segment> parse_packet(std::uint32_t link_type, wire::BytesView packet);

/// True if the packet is the first fragment of an IPv4 datagram.
bool begins_fragments(std::uint32_t link_type, wire::BytesView packet);

/// True for link types that parse_packet supports.
bool is_known_link_type(std::uint32_t link_type);

}  // namespace sonar::recording
