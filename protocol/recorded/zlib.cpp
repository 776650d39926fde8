#include "protocol/recorded/zlib.hpp"

#include <zlib.h>

#include <array>

namespace sonar::recording {
namespace {

const Bytef* as_bytef(wire::BytesView bytes) { return static_cast<const Bytef*>(static_cast<const void*>(bytes.data())); }

}  // namespace

std::optional<wire::Bytes> inflate(wire::BytesView stream, std::size_t limit) {
  z_stream state{};
  if (inflateInit(&state) != Z_OK) return std::nullopt;
  state.next_in = const_cast<Bytef*>(as_bytef(stream));  // zlib does not write to it
  state.avail_in = static_cast<uInt>(stream.size());
  wire::Bytes out;
  std::array<std::byte, 32768> block;
  int status = Z_OK;
  while (status == Z_OK && out.size() <= limit) {  // reads up to the limit, because a small stream can hold gigabytes
    state.next_out = static_cast<Bytef*>(static_cast<void*>(block.data()));
    state.avail_out = static_cast<uInt>(block.size());
    status = ::inflate(&state, Z_NO_FLUSH);
    out.insert(out.end(), block.begin(), block.end() - state.avail_out);
  }
  inflateEnd(&state);
  if (status != Z_STREAM_END || out.size() > limit) return std::nullopt;
  return out;
}

std::uint32_t crc32(wire::BytesView bytes, std::uint32_t crc) {
  return bytes.empty() ? crc : static_cast<std::uint32_t>(::crc32_z(crc, as_bytef(bytes), bytes.size()));
}

}  // namespace sonar::recording
