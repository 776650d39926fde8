// Options of an emulated BlueView sonar, by name, under `options:` of a sonar in the configuration.
#pragma once

#include <span>
#include <string_view>

#include "protocol/options.hpp"

namespace sonar::blueview {

namespace option_name {
inline constexpr std::string_view heads_base = "heads_base", strict_range = "strict_range", compression = "compression";
}

std::span<const protocol::Option> options();
using protocol::text_option;

}  // namespace sonar::blueview
