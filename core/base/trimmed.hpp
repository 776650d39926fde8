// Removes blanks at both ends of a text.
#pragma once

#include <string_view>

namespace sonar {

/// The text without leading and trailing characters that `blanks` contains.
constexpr std::string_view trimmed(std::string_view text, std::string_view blanks) {
  const auto first = text.find_first_not_of(blanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(blanks) - first + 1);
}

}  // namespace sonar
