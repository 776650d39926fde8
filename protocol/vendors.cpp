#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <numeric>

#include "protocol/blueview/blueview.hpp"
#include "protocol/oculus/oculus.hpp"
#include "protocol/vendor.hpp"

namespace sonar::protocol {
namespace {

/// Levenshtein distance, for "did you mean".
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i + 1;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t substituted = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({substituted, row[j] + 1, row[j + 1] + 1});
    }
  }
  return row.back();
}

std::string_view nearest(std::string_view given, std::span<const std::string_view> valid) {
  if (valid.empty()) return {};
  return *std::min_element(valid.begin(), valid.end(), [&](std::string_view a, std::string_view b) {
    return edit_distance(given, a) < edit_distance(given, b);
  });
}

std::string quoted(std::string_view text) { return std::string("'").append(text).append("'"); }

std::string listed(std::span<const std::string_view> names) {
  std::string text;
  for (const std::string_view name : names) text.append(text.empty() ? "" : ", ").append(name);
  return text;
}

const Option* find_option(const Vendor& vendor, std::string_view name) {
  for (const Option& option : vendor.options())
    if (option.name == name) return &option;
  return nullptr;
}

bool is_number_of(const Option& option, std::string_view text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || !std::isfinite(value)) return false;
  return option.highest > 0 ? value >= option.lowest && value <= option.highest : value > 0;
}

/// Empty when the pair is fine.
std::string complaint(const Vendor& vendor, const std::string& name, const std::string& value) {
  const Option* option = find_option(vendor, name);
  if (option == nullptr) {
    std::vector<std::string_view> names;
    for (const Option& known : vendor.options()) names.push_back(known.name);
    return "unknown option " + quoted(name) + " of " + std::string(vendor.name()) + ", the nearest is " +
           quoted(nearest(name, names));
  }
  if (option->allowed.empty()) {
    const bool fine = value == option->default_value || is_number_of(*option, value);
    return fine ? "" : "option " + name + " must be a " + numbers_of(*option) + ", not " + quoted(value);
  }
  if (std::find(option->allowed.begin(), option->allowed.end(), value) != option->allowed.end()) return "";
  return "option " + name + " cannot be " + quoted(value) + ", the nearest is " + quoted(nearest(value, option->allowed)) +
         " (valid: " + listed(option->allowed) + ")";
}

}  // namespace

Result<OptionValues> check_options(const Vendor& vendor, const OptionValues& given) {
  for (const auto& [name, value] : given)
    if (const std::string text = complaint(vendor, name, value); !text.empty()) return failure(ErrorKind::config, text);
  OptionValues complete = given;
  for (const Option& option : vendor.options()) complete.try_emplace(std::string(option.name), option.default_value);
  return complete;
}

std::span<const Vendor* const> vendors() {
  static const std::array<const Vendor*, 2> all{&oculus::vendor(), &blueview::vendor()};
  return all;
}

Result<Profile> find_profile(std::string_view profile) {
  std::vector<std::string_view> names;
  for (const Vendor* vendor : vendors()) {
    for (const auto& model : vendor->models()) {
      if (model->profile == profile) return Profile{vendor, model};
      names.push_back(model->profile);
    }
  }
  std::partial_sort(
      names.begin(), names.begin() + std::min<std::ptrdiff_t>(3, std::ssize(names)), names.end(),
      [&](std::string_view a, std::string_view b) { return edit_distance(profile, a) < edit_distance(profile, b); });
  names.resize(std::min<std::size_t>(3, names.size()));
  return failure(ErrorKind::config, "unknown profile " + quoted(profile) + ", the nearest are " + listed(names));
}

}  // namespace sonar::protocol
