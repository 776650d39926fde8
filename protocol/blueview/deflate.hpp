// Compresses samples by zlib's deflate.
#pragma once

#include "protocol/wire/wire.hpp"

namespace sonar::blueview {

/// A zlib stream (RFC 1950) at the fastest level; empty when zlib has no memory.
wire::Bytes deflated(wire::BytesView plain);

/// Decompresses a stream of exactly `size` bytes; empty if it has another size or is damaged.
wire::Bytes inflated(wire::BytesView packed, std::size_t size);

}  // namespace sonar::blueview
