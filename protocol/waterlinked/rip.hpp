// The datagrams of the Range Image Protocol: "RIP2", length, Snappy block, CRC-32. "RIP1" has no Snappy compression.
#pragma once

#include <optional>

#include "protocol/wire/wire.hpp"

namespace sonar::waterlinked {

using wire::Bytes;
using wire::BytesView;

enum class Rip { one = 1, two = 2 };
inline constexpr std::size_t rip_overhead = 12;    // bytes around the content
inline constexpr std::size_t longest_rip = 65507;  // a packet is a datagram

Bytes rip_packet(BytesView content, Rip version = Rip::two);
/// The length that a packet states; 0: not the beginning of a packet.
std::size_t rip_length(BytesView beginning);
/// The content of a whole packet. nullopt: a wrong length, a wrong CRC, or invalid Snappy data.
std::optional<Bytes> rip_content(BytesView packet);

}  // namespace sonar::waterlinked
