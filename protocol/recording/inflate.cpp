#include "protocol/recording/inflate.hpp"

#include <zlib.h>

#include <algorithm>
#include <array>

namespace sonar::recording {

std::optional<wire::Bytes> inflate(wire::BytesView stream, std::size_t limit) {
  z_stream state{};
  if (inflateInit(&state) != Z_OK) return std::nullopt;
  std::vector<Bytef> in(stream.size());
  std::transform(stream.begin(), stream.end(), in.begin(), [](std::byte b) { return std::to_integer<Bytef>(b); });
  state.next_in = in.data();
  state.avail_in = static_cast<uInt>(in.size());
  wire::Bytes out;
  std::array<Bytef, 32768> block;
  int told = Z_OK;
  while (told == Z_OK && out.size() <= limit) {
    state.next_out = block.data();
    state.avail_out = static_cast<uInt>(block.size());
    told = ::inflate(&state, Z_NO_FLUSH);
    const std::size_t made = block.size() - state.avail_out;
    std::transform(block.begin(), block.begin() + static_cast<std::ptrdiff_t>(made), std::back_inserter(out),
                   [](Bytef b) { return static_cast<std::byte>(b); });
  }
  inflateEnd(&state);
  if (told != Z_STREAM_END || out.size() > limit) return std::nullopt;
  return out;
}

}  // namespace sonar::recording
