// Counts of the distances that a MAVLink link sends, for status and metrics.
#pragma once

#include <cstdint>
#include <string>

namespace sonar {

/// Messages since the start. Distances that the vehicle did not request are not counted.
struct LinkFigures {
  std::string endpoint;  // such as "udpin:127.0.0.1:14551"
  std::string vehicle;
  std::uint64_t sent = 0;
  std::uint64_t withheld = 0;     // messages that a fault withheld
  std::uint64_t unaddressed = 0;  // messages for which the link had not detected a vehicle
  std::uint64_t refused = 0;      // messages that the socket refused: a full buffer, or no route to the other end

  std::uint64_t dropped() const { return withheld + unaddressed + refused; }
};

}  // namespace sonar
