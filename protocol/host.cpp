// Checks of what users request: options of a product, settings of a ping. The settings that a host puts back.
#include "protocol/host.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "core/text/format.hpp"
#include "core/text/nearest.hpp"

namespace sonar::protocol {
namespace {

std::string in_quotes(std::string_view text) { return std::string("'").append(text).append("'"); }

const Option* find_option(const Vendor& vendor, std::string_view name) {
  for (const Option& option : vendor.options())
    if (option.name == name) return &option;
  return nullptr;
}

bool is_number_of(const Option& option, std::string_view text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || !std::isfinite(value)) return false;
  if (option.whole && std::trunc(value) != value) return false;
  return value >= option.lowest && value <= option.highest;
}

/// Returns why the option or its value is refused; empty if both are valid.
std::string complaint(const Vendor& vendor, const std::string& name, const std::string& value) {
  const Option* option = find_option(vendor, name);
  if (option == nullptr) {
    std::vector<std::string_view> names;
    for (const Option& known : vendor.options()) names.push_back(known.name);
    return "unknown option " + in_quotes(name) + " of " + std::string(vendor.name()) + text::suggestion(name, names, "options");
  }
  if (option->allowed.empty()) {
    const bool fine =
        value == option->default_value || (!option->word.empty() && value == option->word) || is_number_of(*option, value);
    return fine ? "" : "option " + name + " must be a " + numbers_of(*option) + ", not " + in_quotes(value);
  }
  if (std::find(option->allowed.begin(), option->allowed.end(), value) != option->allowed.end()) return "";
  return "option " + name + " cannot be " + in_quotes(value) + text::suggestion(value, option->allowed, "values");
}

}  // namespace

Result<OptionValues> check_options(const Vendor& vendor, const OptionValues& given) {
  for (const auto& [name, value] : given)
    if (const std::string text = complaint(vendor, name, value); !text.empty()) return failure(ErrorKind::config, text);
  OptionValues complete = given;
  for (const Option& option : vendor.options()) complete.try_emplace(std::string(option.name), option.default_value);
  return complete;
}

// A setting that a make does not have is an error. If it were ignored, a user would assume that the ping was made with it.
Result<void> accept_settings(const Wanted& wanted, std::string_view title, std::initializer_list<std::string_view> known) {
  const SettingsOverride& s = wanted.settings;
  std::vector<std::string_view> given;
  for (const auto& [name, is_given] : {std::pair<std::string_view, bool>{"range", s.range_m.has_value()},
                                       {"rate", s.rate_hz.has_value()},
                                       {"gain", s.gain_percent.has_value()},
                                       {"mode", s.mode.has_value()},
                                       {"beams", s.beams.has_value()},
                                       {"bits", s.sample_bits.has_value()},
                                       {"gains", s.row_gains.has_value()}})
    if (is_given) given.push_back(name);
  for (const auto& [name, value] : wanted.more) given.push_back(name);
  for (const std::string_view name : given) {
    if (std::find(known.begin(), known.end(), name) != known.end()) continue;
    if (known.size() == 0)
      return failure(ErrorKind::usage, std::string("--").append(name).append(" does not apply to ").append(title) +
                                           ", whose drivers set nothing: use `sonarctl set sonar`");
    return failure(ErrorKind::usage, std::string("--").append(name).append(" does not apply to ").append(title) +
                                         ", which has --" + text::joined(known, ", --"));
  }
  return {};
}

std::optional<std::string> ChangedSetting::on_answer(const std::string& value) {
  switch (++answers) {
    case 1:  // the sonar may still have what a host set that has lost it
      if (before.empty() || (!ours.empty() && ours != value)) before = value;
      break;
    case 2:
      ours = value;
      break;
    case 3:
      if (value == ours && value != before) return before;
      break;
    default:
      break;
  }
  return std::nullopt;
}

bool ChangedSetting::ends_early() {
  answers = ours.empty() ? 0 : 2;
  return answers > 0;
}

}  // namespace sonar::protocol
