// Reads integers at any offset of a block of bytes; 0 if the block is too short. Used for the headers of packets and of capture
// files.
#pragma once

#include <algorithm>
#include <cstdint>

#include "protocol/wire/wire.hpp"

namespace sonar::recording {

template <class T>
T number_at(wire::BytesView bytes, std::size_t offset, wire::Endian endian) {
  T value = 0;
  wire::Reader reader(bytes.subspan(std::min(offset, bytes.size())), endian);
  reader("number", value);
  return value;
}
inline std::uint16_t u16_at(wire::BytesView bytes, std::size_t offset, wire::Endian endian = wire::Endian::big) {
  return number_at<std::uint16_t>(bytes, offset, endian);
}
inline std::uint32_t u32_at(wire::BytesView bytes, std::size_t offset, wire::Endian endian = wire::Endian::big) {
  return number_at<std::uint32_t>(bytes, offset, endian);
}

}  // namespace sonar::recording
