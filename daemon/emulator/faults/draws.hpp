// Random numbers for faults: functions of the seed, the fault, the sonar, the ping and the client.
#pragma once

#include <cstdint>

#include "core/base/random.hpp"
#include "core/base/units.hpp"

namespace sonar {

struct FaultDraws {
  Seed seed{};
  std::uint32_t fault = 0;  // key made from the fault's name
  std::uint32_t sonar = 0, ping = 0, client = 0;

  /// Returns the draw with that index, 32 random bits.
  std::uint32_t bits(std::uint32_t index) const {
    const auto key = static_cast<std::uint64_t>(seed);
    return philox(index, ping, client, sonar ^ fault, static_cast<std::uint32_t>(key) ^ fault,
                  static_cast<std::uint32_t>(key >> 32))
        .v[0];
  }
  /// Returns a number below `end`; `end` > 0.
  std::size_t below(std::size_t end, std::uint32_t index) const { return static_cast<std::size_t>(bits(index)) % end; }
  /// Returns a value in (0, 1).
  double uniform(std::uint32_t index) const { return static_cast<double>(uniform_open(bits(index))); }
};

}  // namespace sonar
