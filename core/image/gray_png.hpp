// Writes 8-bit or 16-bit integers, such as samples and labels, as grey PNG files without a colour map.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/base/result.hpp"

namespace sonar {

/// Little-endian values, `bits` / 8 bytes each, [height][width]; 8 or 16 bits. Equal values give equal bytes.
Result<std::vector<std::byte>> encode_gray_png(std::span<const std::byte> values, int width, int height, int bits);

}  // namespace sonar
