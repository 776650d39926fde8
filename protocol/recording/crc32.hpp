// CRC-32 as zlib, Ethernet and MCAP have it (polynomial EDB88320, reflected). For MCAP chunks, summary and data.
#pragma once

#include <array>
#include <cstdint>

#include "protocol/wire/wire.hpp"

namespace sonar::recording {

constexpr std::array<std::uint32_t, 256> crc32_table() {
  std::array<std::uint32_t, 256> made{};
  for (std::uint32_t i = 0; i < 256; ++i) {
    std::uint32_t c = i;
    for (int bit = 0; bit < 8; ++bit) c = (c & 1u) != 0 ? 0xEDB88320u ^ c >> 1 : c >> 1;
    made[i] = c;
  }
  return made;
}

class Crc32 {
 public:
  void add(wire::BytesView bytes) {
    for (const std::byte b : bytes) state_ = state_ >> 8 ^ table[(state_ ^ std::to_integer<std::uint32_t>(b)) & 0xFFu];
  }
  std::uint32_t value() const { return ~state_; }

 private:
  static constexpr std::array<std::uint32_t, 256> table = crc32_table();
  std::uint32_t state_ = ~0u;
};

inline std::uint32_t crc32(wire::BytesView bytes) {
  Crc32 crc;
  crc.add(bytes);
  return crc.value();
}

}  // namespace sonar::recording
