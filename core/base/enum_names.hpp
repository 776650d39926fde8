// Finds enum values by name. An array beside each such enum has the names, in the order of the values.
#pragma once

#include <algorithm>
#include <array>
#include <optional>
#include <string_view>

namespace sonar {

/// The value that has this name.
template <class Enum, std::size_t n>
std::optional<Enum> enum_from(std::string_view name, const std::array<std::string_view, n>& names) {
  const auto it = std::find(names.begin(), names.end(), name);
  if (it == names.end()) return std::nullopt;
  return static_cast<Enum>(it - names.begin());
}

}  // namespace sonar
