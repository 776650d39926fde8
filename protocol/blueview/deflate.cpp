#include "protocol/blueview/deflate.hpp"

#include <zlib.h>

#include <cstring>

namespace sonar::blueview {

wire::Bytes deflated(wire::BytesView plain) {
  // zlib has a byte type of its own. Copying the bytes avoids casts of buffers.
  std::vector<Bytef> in(plain.size()), out(compressBound(static_cast<uLong>(plain.size())));
  if (!plain.empty()) std::memcpy(in.data(), plain.data(), plain.size());
  auto size = static_cast<uLongf>(out.size());
  if (compress2(out.data(), &size, in.data(), static_cast<uLong>(in.size()), Z_BEST_SPEED) != Z_OK) return {};
  wire::Bytes result(size);
  std::memcpy(result.data(), out.data(), size);
  return result;
}

wire::Bytes inflated(wire::BytesView packed, std::size_t size) {
  // A stream of deflate grows at most 1032-fold (zlib's technical notes). A false size must not make this allocate more.
  constexpr std::size_t best = 1032;
  if (size > best * packed.size() + 64 || size == 0) return {};
  std::vector<Bytef> in(packed.size()), out(size);
  if (!packed.empty()) std::memcpy(in.data(), packed.data(), packed.size());
  auto made = static_cast<uLongf>(size);
  auto used = static_cast<uLong>(packed.size());
  if (uncompress2(out.data(), &made, in.data(), &used) != Z_OK || made != size || used != packed.size()) return {};
  wire::Bytes result(size);
  std::memcpy(result.data(), out.data(), size);
  return result;
}

}  // namespace sonar::blueview
