// Properties of a Sonar 3D-15 that the public sources do not state, as options of a sonar's configuration.
#pragma once

#include <span>
#include <string_view>

#include "protocol/options.hpp"

namespace sonar::waterlinked {

namespace option_name {
inline constexpr std::string_view release = "release", rip = "rip", acoustics_at_start = "acoustics_at_start",
                                  udp_at_start = "udp_at_start", clock = "clock";
}

std::span<const protocol::Option> options();
using protocol::text_option;

}  // namespace sonar::waterlinked
