// Finds enum values by name. Each such enum has an array of names beside it, in the order of the values.
#pragma once

#include <algorithm>
#include <array>
#include <optional>
#include <string_view>

namespace sonar {

/// Returns the value that has this name.
template <class Enum, std::size_t n>
std::optional<Enum> enum_from(std::string_view name, const std::array<std::string_view, n>& names) {
  const auto it = std::find(names.begin(), names.end(), name);
  if (it == names.end()) return std::nullopt;
  return static_cast<Enum>(it - names.begin());
}

}  // namespace sonar
