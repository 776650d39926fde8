// Functions of zlib for recordings and packets: decompression (.oculus files), CRC-32 (MCAP, packets of a sonar).
#pragma once

#include <cstdint>
#include <optional>

#include "protocol/wire/wire.hpp"

namespace sonar::recording {

/// Returns the decompressed stream; nullopt if it is damaged or has more than `limit` bytes.
std::optional<wire::Bytes> inflate(wire::BytesView stream, std::size_t limit);

/// Returns the CRC-32 of the bytes. `crc`: the CRC of preceding bytes, to continue it.
std::uint32_t crc32(wire::BytesView bytes, std::uint32_t crc = 0);

}  // namespace sonar::recording
