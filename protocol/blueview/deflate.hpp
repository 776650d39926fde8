// zlib's deflate behind one function: the only file of the protocols that knows it.
#pragma once

#include "protocol/wire/wire.hpp"

namespace sonar::blueview {

/// A zlib stream (RFC 1950) at the fastest level; empty when zlib has no memory.
wire::Bytes deflated(wire::BytesView plain);

}  // namespace sonar::blueview
