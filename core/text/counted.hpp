// Formats a number with its noun.
#pragma once

#include <concepts>
#include <string>
#include <string_view>

namespace sonar::text {

/// Returns "1 beam" or "2 beams".
template <std::integral N>
std::string counted(N count, std::string_view what) {
  return std::to_string(count).append(" ").append(what).append(count == 1 ? "" : "s");
}

}  // namespace sonar::text
