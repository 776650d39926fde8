#include "protocol/m3/options.hpp"

#include <array>

namespace sonar::m3 {

std::span<const protocol::Option> options() {
  static const std::array<protocol::Option, 1> all{{
      {option_name::positive_angles,
       {"port", "starboard"},
       "port",
       "side of the beams with positive angles; packets begin with the beam of the least angle"},
  }};
  return all;
}

}  // namespace sonar::m3
