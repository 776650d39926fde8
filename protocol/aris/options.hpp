// Properties of an ARIS that the public sources do not state, as options of a sonar's configuration.
#pragma once

#include <span>
#include <string_view>

#include "protocol/options.hpp"

namespace sonar::aris {

namespace option_name {
inline constexpr std::string_view cycle = "cycle", reordered = "reordered", receivers = "receivers", silence_s = "silence_s",
                                  header_bytes = "header_bytes", datagram_bytes = "datagram_bytes";
}

std::span<const protocol::Option> options();
using protocol::number_option;
using protocol::text_option;

}  // namespace sonar::aris
