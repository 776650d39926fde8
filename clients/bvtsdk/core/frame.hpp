// Frames of BVE1, our own link and the body of our recordings: a 16-byte header, then the payload.
// docs/protocols/blueview-link.md is the description; the link and the recordings are built on this.
#pragma once

#include "clients/bvtsdk/core/bytes.hpp"

namespace sonar::bvt {

inline constexpr std::size_t frame_header_size = 16;
inline constexpr std::size_t longest_payload = 64u << 20;

enum class FrameType : std::uint16_t {
  hello = 0x0001,
  set = 0x0002,
  get = 0x0003,
  ping = 0x0004,
  subscribe = 0x0005,
  keep_alive = 0x0006,
  nav_data = 0x0101,
  event_mark = 0x0102,
  index = 0x0103,  // recordings only: where the frames are
  hello_ok = 0x8001,
  ping_data = 0x8004,
  error = 0xFFFF,
};

struct FrameHeader {
  FrameType type{};
  std::uint16_t flags = 0;
  std::uint32_t request_id = 0;
  std::uint32_t payload_size = 0;
};

inline void put_header(Bytes& out, const FrameHeader& header) {
  for (const char c : {'B', 'V', 'E', '1'}) out.push_back(static_cast<std::uint8_t>(c));
  put(out, static_cast<std::uint16_t>(header.type));
  put(out, header.flags);
  put(out, header.request_id);
  put(out, header.payload_size);
}

/// False when the bytes are fewer than 16, start with other letters or announce more than the link allows.
inline bool take_header(BytesView bytes, FrameHeader& header) {
  Reader reader(bytes);
  const BytesView magic = reader.block(4);
  header.type = static_cast<FrameType>(reader.take<std::uint16_t>());
  header.flags = reader.take<std::uint16_t>();
  header.request_id = reader.take<std::uint32_t>();
  header.payload_size = reader.take<std::uint32_t>();
  return reader.ok() && std::memcmp(magic.data, "BVE1", 4) == 0 && header.payload_size <= longest_payload;
}

}  // namespace sonar::bvt
