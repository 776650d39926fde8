// Random numbers of faults: functions of (seed, fault, sonar) and of what is drawn for.
#pragma once

#include <cstdint>

#include "core/base/random.hpp"
#include "core/base/units.hpp"

namespace sonar {

struct FaultDraws {
  Seed seed{};
  std::uint32_t fault = 0;  // made from its name
  std::uint32_t sonar = 0, ping = 0, client = 0;

  /// The draw of that index, any of 2^32.
  std::uint32_t bits(std::uint32_t index) const {
    const auto key = static_cast<std::uint64_t>(seed);
    return philox(index, ping, client, sonar ^ fault, static_cast<std::uint32_t>(key) ^ fault,
                  static_cast<std::uint32_t>(key >> 32))
        .v[0];
  }
  /// Below `end`, which is above 0.
  std::size_t below(std::size_t end, std::uint32_t index) const { return static_cast<std::size_t>(bits(index)) % end; }
  /// A value in (0, 1).
  double uniform(std::uint32_t index) const { return static_cast<double>(uniform_open(bits(index))); }
};

}  // namespace sonar
