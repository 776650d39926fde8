// The laws by which the family's range finders read a ping of one beam: the distance to the strongest echo, and range and gain
// for the next ping. Pure functions; the laws are assumptions (docs/protocols/ping1d.md).
#pragma once

#include <cstdint>
#include <span>

#include "core/sonar/ping.hpp"

namespace sonar::ping {

inline constexpr double nearest_echo_m = 0.3;
inline constexpr std::uint32_t shortest_range_mm = 1000;

/// Messages that come of a ping, as bits.
using Results = unsigned;
inline constexpr Results no_result = 0;

struct Echo {
  double range_m = 0;  // in the device's metres
  double peak = 0;     // the highest amplitude; 255 is full scale
  int confidence = 0;  // per cent
};
/// The strongest echo of a profile: where it begins.
Echo find_echo(const Ping& ping);

/// From the sonar on.
struct Reach {
  std::uint32_t length_mm = 0;
  int gain = 0;  // index of a gain
};
struct ReachLimits {
  std::span<const double> gains;  // amplifications, rising
  std::uint32_t most_mm = 0;
};
/// Range and gain after a ping that was made with `made_with`, and in which that echo was found.
Reach adjusted(const Reach& made_with, const Echo& echo, const ReachLimits& limits);

}  // namespace sonar::ping
