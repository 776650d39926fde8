// A ping of either kind of sonar, and what listen, view and stats say of it. What only one kind has, they look up in its own
// type.
#pragma once

#include <cstdint>
#include <variant>

#include "clients/bvtsdk/core/polar_ping.hpp"
#include "protocol/oculus/decode.hpp"

namespace sonar::clients {

struct BlueViewPing {
  bvt::PolarPing polar;
  double frequency_hz = 0;       // of the head, as its sonar's greeting says
  std::size_t message_size = 0;  // bytes
};
using AnyPing = std::variant<oculus::DecodedPing, BlueViewPing>;

struct PingFacts {
  std::uint32_t number = 0;
  unsigned beams = 0, rows = 0, bits = 0;
  double row_m = 0, range_m = 0;  // range_m: the last row's far end
  double frequency_hz = 0;
  std::size_t message_size = 0;  // bytes
};
PingFacts facts_of(const AnyPing& ping);

}  // namespace sonar::clients
