#include "protocol/aris/options.hpp"

#include <array>

namespace sonar::aris {

std::span<const protocol::Option> options() {
  static const std::array<protocol::Option, 6> all{{
      {option_name::cycle,
       {"lenient", "documented"},
       "lenient",
       "a cycle period up to 5 % too short: raise it and report the settings as constrained, or refuse them"},
      {option_name::reordered, {"false", "true"}, "false", "true: frames carry the picture, not the channels of each ping"},
      {option_name::receivers,
       {"any", "controller"},
       "any",
       "where a controller may have frames sent: to any address, or only to its own and to multicast groups"},
      {option_name::silence_s, {}, "10", "a controller that sends no command for so long is disconnected, seconds", 5, 600},
      {option_name::header_bytes, {}, "744", "of a frame header: older firmware has fewer", 128, 744, {}, true},
      {option_name::datagram_bytes,
       {},
       "1400",
       "longest datagram: above 1472 they are fragmented on Ethernet",
       1400,
       65000,
       {},
       true},
  }};
  return all;
}

}  // namespace sonar::aris
