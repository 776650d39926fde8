// Constants of BVE1, sonard's own link between the drop-in SDK libraries and the daemon (docs/protocols/blueview-link.md).
// The daemon and the drop-in libraries include this file, so it needs only C++17 and the standard library.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace sonar::blueview {

inline constexpr std::uint16_t tcp_port = 14750;
inline constexpr std::uint16_t discovery_port = 14751;
inline constexpr std::uint16_t protocol_version = 1;
inline constexpr std::array<std::uint8_t, 4> magic{'B', 'V', 'E', '1'};
inline constexpr std::array<std::uint8_t, 4> discovery_question{'B', 'V', 'E', '?'};
inline constexpr std::array<std::uint8_t, 4> discovery_answer{'B', 'V', 'E', '!'};
inline constexpr std::size_t header_size = 16;             // magic, type, flags, request id, payload length
inline constexpr std::size_t longest_payload = 64u << 20;  // limit for messages of the sonar; frames.hpp limits those of hosts

/// A reply has the type of its request with this bit set.
inline constexpr std::uint16_t reply_bit = 0x8000;
enum class FrameType : std::uint16_t {
  hello = 0x0001,
  set = 0x0002,
  get = 0x0003,
  ping = 0x0004,
  subscribe = 0x0005,
  keep_alive = 0x0006,
  nav_data = 0x0101,
  event_mark = 0x0102,
  index = 0x0103,  // only in recordings: offsets of the frames
  hello_ok = hello | reply_bit,
  ping_data = ping | reply_bit,
  error = 0xFFFF,
};
constexpr FrameType reply_to(FrameType request) {
  return static_cast<FrameType>(static_cast<std::uint16_t>(request) | reply_bit);
}

/// Properties that SET and GET address.
enum class Key : std::uint16_t {
  start_range = 1,
  stop_range = 2,
  range = 3,  // two floats
  sound_speed = 4,
  gain = 5,
  tvg = 6,
  fluid = 7,
  transmit = 8,
  ping_interval = 9,
  dynamic_power = 10,
  source_level = 11,
  name = 12,
  local_clock = 13,
};

/// Type of a value in SET and GET.
enum class Kind : std::uint8_t { integer = 0, number = 1, text = 2 };

/// The error codes of the vendor's SDK that an error frame of this link can have.
enum class Code : std::int32_t {
  bad_parameter = 6,
  timeout = 18,
  no_head = 2010,
  bad_range = 4009,
  bad_packet_type = 14001,
  bad_packet_version = 14004,
};

}  // namespace sonar::blueview
