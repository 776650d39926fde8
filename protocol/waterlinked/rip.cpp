#include "protocol/waterlinked/rip.hpp"

#include <snappy.h>
#include <zlib.h>

#include <cstring>
#include <string>

namespace sonar::waterlinked {
namespace {

constexpr std::size_t head_bytes = 8, largest_content = 1 << 20;

std::string text_of(BytesView bytes) {
  std::string text(bytes.size(), '\0');
  if (!bytes.empty()) std::memcpy(text.data(), bytes.data(), bytes.size());
  return text;
}
Bytes bytes_of(const std::string& text) {
  Bytes bytes(text.size());
  if (!text.empty()) std::memcpy(bytes.data(), text.data(), text.size());
  return bytes;
}

/// CRC-32 of IEEE 802.3, as zlib computes it.
std::uint32_t crc_of(BytesView bytes) {
  return static_cast<std::uint32_t>(crc32_z(0, static_cast<const Bytef*>(static_cast<const void*>(bytes.data())), bytes.size()));
}

void append_u32(Bytes& out, std::uint32_t value) {
  for (int b = 0; b < 4; ++b) out.push_back(static_cast<std::byte>(value >> (8 * b) & 0xFF));
}
std::uint32_t u32_at(BytesView bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t b = 4; b-- > 0;) value = value << 8 | std::to_integer<std::uint32_t>(bytes[at + b]);
  return value;
}

}  // namespace

// The length counts the whole packet, and the CRC everything before itself.
Bytes rip_packet(BytesView content, Rip version) {
  Bytes block(content.begin(), content.end());
  if (version == Rip::two) {
    const std::string plain = text_of(content);
    std::string packed;
    snappy::Compress(plain.data(), plain.size(), &packed);
    block = bytes_of(packed);
  }
  Bytes packet = bytes_of(version == Rip::two ? "RIP2" : "RIP1");
  append_u32(packet, static_cast<std::uint32_t>(block.size() + rip_overhead));
  packet.insert(packet.end(), block.begin(), block.end());
  append_u32(packet, crc_of(packet));
  return packet;
}

std::size_t rip_length(BytesView beginning) {
  if (beginning.size() < head_bytes) return 0;
  const std::string magic = text_of(beginning.first(4));
  const std::size_t length = u32_at(beginning, 4);
  return (magic == "RIP2" || magic == "RIP1") && length >= rip_overhead && length <= longest_rip ? length : 0;
}

std::optional<Bytes> rip_content(BytesView packet) {
  if (packet.empty() || rip_length(packet) != packet.size()) return std::nullopt;
  const bool packed = packet[3] == std::byte{'2'};  // "RIP2" has a Snappy block, "RIP1" the content itself
  const std::size_t crc_at = packet.size() - 4;
  if (u32_at(packet, crc_at) != crc_of(packet.first(crc_at))) return std::nullopt;
  const BytesView block = packet.subspan(head_bytes, crc_at - head_bytes);
  if (!packed) return Bytes(block.begin(), block.end());
  const std::string text = text_of(block);
  std::size_t size = 0;
  std::string plain;
  // The stated size is checked before it is allocated.
  if (!snappy::GetUncompressedLength(text.data(), text.size(), &size) || size > largest_content) return std::nullopt;
  if (!snappy::Uncompress(text.data(), text.size(), &plain)) return std::nullopt;
  return bytes_of(plain);
}

}  // namespace sonar::waterlinked
