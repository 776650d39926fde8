// zlib streams inside recordings of others. Used by the reader of .oculus files.
#pragma once

#include <optional>

#include "protocol/wire/wire.hpp"

namespace sonar::recording {

/// What the stream holds, or nothing when it is damaged or holds more than `limit` bytes.
std::optional<wire::Bytes> inflate(wire::BytesView stream, std::size_t limit);

}  // namespace sonar::recording
