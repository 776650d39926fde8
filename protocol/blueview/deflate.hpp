// Compression of samples by zlib's deflate.
#pragma once

#include "protocol/wire/wire.hpp"

namespace sonar::blueview {

/// A zlib stream (RFC 1950) at the fastest level; empty when zlib has no memory.
wire::Bytes deflated(wire::BytesView plain);

}  // namespace sonar::blueview
