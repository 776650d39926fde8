// Options of a sonar in the configuration: those that a make offers, and the values; check_options() adds the defaults.
#pragma once

#include <charconv>
#include <cmath>
#include <cstdio>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace sonar::protocol {

/// A property that no source states; users set it under `options:` of a sonar in the configuration.
struct Option {
  std::string_view name;
  std::vector<std::string_view> allowed;  // the first is the default; empty = a number or the word of default_value
  std::string_view default_value;
  std::string_view meaning;
  double lowest = 0, highest = 0;  // limits of a number, inclusive
  std::string_view word = {};      // word that is allowed in place of a number, beside the default
  bool whole = false;              // the number has no fraction
};
/// A text such as "number from 5 to 170" or "whole number from 0 to 255".
inline std::string numbers_of(const Option& option) {
  const std::string kind = option.whole ? "whole number" : "number";
  char text[64];
  std::snprintf(text, sizeof text, " from %.9g to %.9g", option.lowest, option.highest);
  return kind + text + (option.word.empty() ? "" : ", or " + std::string(option.word));
}
using OptionValues = std::map<std::string, std::string>;

inline std::string_view text_option(const OptionValues& values, std::string_view name) {
  const auto found = values.find(std::string(name));
  return found == values.end() ? std::string_view{} : std::string_view(found->second);
}

/// The option's number; nothing if it is a word.
inline std::optional<double> given_number(const OptionValues& values, std::string_view name) {
  const std::string_view text = text_option(values, name);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool is_number = error == std::errc{} && end == text.data() + text.size() && std::isfinite(value);
  return is_number ? std::optional(value) : std::nullopt;
}

/// The option's number, or 0 if it is a word.
inline double number_option(const OptionValues& values, std::string_view name) { return given_number(values, name).value_or(0); }

}  // namespace sonar::protocol
