// Serial lines, whose rate limits the scans of some sonars.
#pragma once

#include <chrono>

#include "core/base/units.hpp"

namespace sonar::protocol {

/// Returns the transmission time of `bytes`, each with a start and a stop bit; 0 for an unlimited line (rate 0).
inline std::chrono::nanoseconds serial_time(double bytes, double bits_per_s) {
  constexpr double bits_of_byte = 10;
  return bits_per_s > 0 ? nanoseconds_from(bits_of_byte * bytes / bits_per_s) : std::chrono::nanoseconds(0);
}

}  // namespace sonar::protocol
