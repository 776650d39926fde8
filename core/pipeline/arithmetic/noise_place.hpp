// The place in the table of shaped noise at which a column of a ping begins to read, and the quarter turn of what it reads: the
// draw that receiver noise, the leak and the water's grains share. C++17-clean, standard library only.
#pragma once

#include <cstdint>

#include "core/base/host_device.hpp"
#include "core/base/random.hpp"

namespace sonar {

inline constexpr std::uint32_t noise_table_samples = 1u << 18;

/// The leak's draws: its sonar numbers, and the ping number of the part that is the same in every ping.
SONAR_HD constexpr std::uint32_t leak_sonar(std::uint32_t sonar) { return sonar ^ static_cast<std::uint32_t>(Domain::leak); }
inline constexpr std::uint32_t every_ping = 0xFFFFFFFFu;
/// The water's grains have these columns; the receiver's noise has the columns below.
inline constexpr std::uint32_t first_volume_column = 1u << 24;
/// Noise columns reserved for noise shared by groups of channels, more than there are groups.
inline constexpr std::uint32_t first_shared_noise_column = first_volume_column - 4096;

/// A random start and one of four quarter turns: the table's own pattern never stands still. `key`: Domain::noise_place.
struct NoisePlace {
  std::uint32_t first = 0;
  bool negative = false, quarter = false;
};
SONAR_HD inline NoisePlace noise_place(const RandomKey& key, std::uint32_t sonar, std::uint32_t ping, std::uint32_t column) {
  const Random4 draw = philox(column, ping, sonar, key);
  return {draw.v[0] % noise_table_samples, (draw.v[1] & 1u) != 0, (draw.v[1] & 2u) != 0};
}

}  // namespace sonar
