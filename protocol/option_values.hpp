// Values of a sonar's options, complete as check_options() makes them.
#pragma once

#include <charconv>
#include <cmath>
#include <optional>
#include <string>
#include <string_view>

#include "protocol/vendor.hpp"

namespace sonar::protocol {

inline std::string_view text_option(const OptionValues& values, std::string_view name) {
  const auto found = values.find(std::string(name));
  return found == values.end() ? std::string_view{} : std::string_view(found->second);
}

/// Nothing: a word stands for the number.
inline std::optional<double> given_number(const OptionValues& values, std::string_view name) {
  const std::string_view text = text_option(values, name);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool is_number = error == std::errc{} && end == text.data() + text.size() && std::isfinite(value);
  return is_number ? std::optional(value) : std::nullopt;
}

/// 0 for a word.
inline double number_option(const OptionValues& values, std::string_view name) { return given_number(values, name).value_or(0); }

}  // namespace sonar::protocol
