// Computes where the noise of a column starts in the table of shaped noise, and by how many quarter turns it is rotated.
// Receiver noise, shared noise, the leak and the volume reverberation use it. The file uses only C++17 and the standard library.
#pragma once

#include <cstdint>

#include "core/base/host_device.hpp"
#include "core/base/random.hpp"

namespace sonar {

inline constexpr std::uint32_t noise_table_samples = 1u << 18;

/// The leak has its own sonar numbers. Its steady part, which is the same in every ping, has one fixed ping number.
SONAR_HD constexpr std::uint32_t leak_sonar(std::uint32_t sonar) { return sonar ^ static_cast<std::uint32_t>(Domain::leak); }
inline constexpr std::uint32_t every_ping = 0xFFFFFFFFu;
/// First column number of the volume reverberation; receiver noise has lower numbers.
inline constexpr std::uint32_t first_volume_column = 1u << 24;
/// First column number of the noise that groups of channels share.
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
