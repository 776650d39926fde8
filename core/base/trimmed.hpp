// Texts without the blanks at their ends.
#pragma once

#include <string_view>

namespace sonar {

/// The text without those of the characters `blanks` that are at its start or end.
constexpr std::string_view trimmed(std::string_view text, std::string_view blanks) {
  const auto first = text.find_first_not_of(blanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(blanks) - first + 1);
}

}  // namespace sonar
