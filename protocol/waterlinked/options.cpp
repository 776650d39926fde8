#include "protocol/waterlinked/options.hpp"

#include <array>

namespace sonar::waterlinked {

std::span<const protocol::Option> options() {
  static const std::array<protocol::Option, 5> all{{
      {option_name::release,
       {"1.8.0", "1.7.1", "1.7.0", "1.6.0"},
       "1.8.0",
       "release of the device's software, which decides the paths of its HTTP API"},
      {option_name::rip, {"2", "1"}, "2", "version of the range image protocol; 1 is without compression"},
      {option_name::acoustics_at_start, {"disabled", "enabled"}, "disabled", "whether it images before a client enables it"},
      {option_name::udp_at_start, {"disabled", "multicast"}, "disabled", "where images are sent before a client sets it"},
      {option_name::clock, {"utc", "since_boot"}, "utc", "since_boot: time stamps begin at 1970, as before NTP"},
  }};
  return all;
}

}  // namespace sonar::waterlinked
