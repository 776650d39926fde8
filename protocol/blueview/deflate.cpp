#include "protocol/blueview/deflate.hpp"

#include <zlib.h>

#include <cstring>

namespace sonar::blueview {

wire::Bytes deflated(wire::BytesView plain) {
  // zlib uses its own byte type: copying in and out avoids casts of buffers.
  std::vector<Bytef> in(plain.size()), out(compressBound(static_cast<uLong>(plain.size())));
  if (!plain.empty()) std::memcpy(in.data(), plain.data(), plain.size());
  auto size = static_cast<uLongf>(out.size());
  if (compress2(out.data(), &size, in.data(), static_cast<uLong>(in.size()), Z_BEST_SPEED) != Z_OK) return {};
  wire::Bytes result(size);
  std::memcpy(result.data(), out.data(), size);
  return result;
}

}  // namespace sonar::blueview
