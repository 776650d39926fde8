// Reads samples of a ping as unsigned integers.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace sonar {

/// The code of the sample `index` in samples of `width` bytes each, 1 to 4, the least significant byte first.
inline std::uint32_t sample_code(std::span<const std::byte> samples, std::size_t index, std::size_t width) {
  std::uint32_t code = 0;
  for (std::size_t b = 0; b < width; ++b) code |= std::to_integer<std::uint32_t>(samples[index * width + b]) << (8 * b);
  return code;
}

}  // namespace sonar
