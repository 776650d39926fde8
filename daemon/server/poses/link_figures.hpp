// Counts of the distances that a MAVLink link sends, for status and metrics. Plain values.
#pragma once

#include <cstdint>
#include <string>

namespace sonar {

/// Messages since the start. Distances that the vehicle did not request are not counted.
struct LinkFigures {
  std::string endpoint;  // "udpin:127.0.0.1:14551"
  std::string vehicle;
  std::uint64_t sent = 0;
  std::uint64_t withheld = 0;     // by a fault
  std::uint64_t unaddressed = 0;  // no vehicle was detected on a listening link
  std::uint64_t refused = 0;      // by the socket: a full buffer, or no route to the other end

  std::uint64_t dropped() const { return withheld + unaddressed + refused; }
};

}  // namespace sonar
