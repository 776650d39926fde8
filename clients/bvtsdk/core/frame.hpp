// Frames of BVE1, used on the link and in recordings: a 16-byte header, then the payload (docs/protocols/blueview-link.md).
#pragma once

#include "clients/bvtsdk/core/bytes.hpp"
#include "protocol/blueview/link.hpp"

namespace sonar::bvt {

using blueview::FrameType;
using blueview::longest_payload;
inline constexpr std::size_t frame_header_size = blueview::header_size;

struct FrameHeader {
  FrameType type{};
  std::uint16_t flags = 0;
  std::uint32_t request_id = 0;
  std::uint32_t payload_size = 0;
};

inline void put_header(Bytes& out, const FrameHeader& header) {
  for (const std::uint8_t letter : blueview::magic) out.push_back(letter);
  put(out, static_cast<std::uint16_t>(header.type));
  put(out, header.flags);
  put(out, header.request_id);
  put(out, header.payload_size);
}

/// Returns false for fewer than 16 bytes, another magic, or a payload longer than the link allows.
inline bool read_header(BytesView bytes, FrameHeader& header) {
  Reader reader(bytes);
  const BytesView magic = reader.block(blueview::magic.size());
  header.type = static_cast<FrameType>(reader.read<std::uint16_t>());
  header.flags = reader.read<std::uint16_t>();
  header.request_id = reader.read<std::uint32_t>();
  header.payload_size = reader.read<std::uint32_t>();
  return reader.ok() && std::memcmp(magic.data, blueview::magic.data(), magic.size) == 0 &&
         header.payload_size <= longest_payload;
}

}  // namespace sonar::bvt
