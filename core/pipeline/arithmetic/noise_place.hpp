// Computes the place in the table of shaped noise where the noise of a column in a ping begins, and the quarter turns by which it
// is rotated. Receiver noise, the leak and the grains of the water use it. C++17-clean, standard library only.
#pragma once

#include <cstdint>

#include "core/base/host_device.hpp"
#include "core/base/random.hpp"

namespace sonar {

inline constexpr std::uint32_t noise_table_samples = 1u << 18;

/// The leak has its own sonar numbers, and its own ping number for the part that is the same in every ping.
SONAR_HD constexpr std::uint32_t leak_sonar(std::uint32_t sonar) { return sonar ^ static_cast<std::uint32_t>(Domain::leak); }
inline constexpr std::uint32_t every_ping = 0xFFFFFFFFu;
/// Column numbers of the grains of the water begin here; receiver noise has lower ones.
inline constexpr std::uint32_t first_volume_column = 1u << 24;
/// Column numbers of noise that groups of channels share begin here; there are fewer groups than numbers.
inline constexpr std::uint32_t first_shared_noise_column = first_volume_column - 4096;

/// A random start and one of four quarter turns, so that patterns of the table do not repeat. `key`: Domain::noise_place.
struct NoisePlace {
  std::uint32_t first = 0;
  bool negative = false, quarter = false;
};
SONAR_HD inline NoisePlace noise_place(const RandomKey& key, std::uint32_t sonar, std::uint32_t ping, std::uint32_t column) {
  const Random4 draw = philox(column, ping, sonar, key);
  return {draw.v[0] % noise_table_samples, (draw.v[1] & 1u) != 0, (draw.v[1] & 2u) != 0};
}

}  // namespace sonar
