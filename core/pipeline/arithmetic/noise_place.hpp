// Where in the table of shaped noise a column of a ping begins to read, and turned by which quarter: the draw that receiver
// noise, the leak and the water's grains share. C++17-clean, standard library only.
#pragma once

#include <cstdint>

#include "core/base/host_device.hpp"
#include "core/base/random.hpp"

namespace sonar {

inline constexpr std::uint32_t noise_table_samples = 1u << 18;

/// A random start and one of four quarter turns: the table's own pattern never stands still.
struct NoisePlace {
  std::uint32_t first = 0;
  bool negative = false, quarter = false;
};
SONAR_HD inline NoisePlace noise_place(std::uint32_t seed_low, std::uint32_t seed_high, std::uint32_t sonar, std::uint32_t ping,
                                       std::uint32_t column) {
  constexpr std::uint32_t place_key = 0x706c6163u;  // keeps these draws apart from the table's
  const Random4 draw = philox(column, ping, sonar, place_key, seed_low, seed_high);
  return {draw.v[0] % noise_table_samples, (draw.v[1] & 1u) != 0, (draw.v[1] & 2u) != 0};
}

}  // namespace sonar
