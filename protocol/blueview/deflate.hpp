// Compression of samples by zlib's deflate.
#pragma once

#include "protocol/wire/wire.hpp"

namespace sonar::blueview {

/// A zlib stream (RFC 1950) at the fastest level; empty when zlib has no memory.
wire::Bytes deflated(wire::BytesView plain);

/// The opposite: exactly `size` bytes, or nothing.
wire::Bytes inflated(wire::BytesView packed, std::size_t size);

}  // namespace sonar::blueview
