// Options of an emulated M3, by name, under `options:` of a sonar in the configuration.
#pragma once

#include <span>
#include <string_view>

#include "protocol/options.hpp"

namespace sonar::m3 {

namespace option_name {
inline constexpr std::string_view positive_angles = "positive_angles";
}

std::span<const protocol::Option> options();

}  // namespace sonar::m3
