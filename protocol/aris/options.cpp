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
       "addresses to which a controller may direct frames: any, or only its own and multicast groups"},
      {option_name::silence_s, {}, "10", "seconds without a command after which a controller is disconnected", 5, 600},
      {option_name::header_bytes, {}, "744", "bytes of a frame header; older firmware sends fewer", 128, 744, {}, true},
      {option_name::datagram_bytes,
       {},
       "1400",
       "longest datagram, in bytes; Ethernet fragments datagrams of more than 1472",
       1400,
       65000,
       {},
       true},
  }};
  return all;
}

}  // namespace sonar::aris
