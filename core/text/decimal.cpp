#include "core/text/decimal.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

namespace sonar::text {
namespace {

bool is_digit(char c) { return c >= '0' && c <= '9'; }

}  // namespace

std::optional<std::uint64_t> parse_unsigned(std::string_view s) {
  if (s.starts_with('+')) s.remove_prefix(1);
  if (s.empty() || !std::all_of(s.begin(), s.end(), is_digit) || (s.size() > 1 && s[0] == '0')) return std::nullopt;
  std::uint64_t v = 0;
  const auto end = std::from_chars(s.data(), s.data() + s.size(), v);
  if (end.ec != std::errc{} || end.ptr != s.data() + s.size()) return std::nullopt;
  return v;
}

std::optional<double> parse_decimal(std::string_view s) {
  const std::string_view whole = s;
  if (s.starts_with('+') || s.starts_with('-')) s.remove_prefix(1);
  std::size_t i = 0;
  while (i < s.size() && is_digit(s[i])) ++i;
  const std::size_t before = i;
  if (before > 1 && s[0] == '0') return std::nullopt;
  std::size_t after = 0;
  if (i < s.size() && s[i] == '.') {
    const std::size_t start = ++i;
    while (i < s.size() && is_digit(s[i])) ++i;
    after = i - start;
  }
  if (before + after == 0) return std::nullopt;
  if (i < s.size() && (s[i] == 'e' || s[i] == 'E')) {
    ++i;
    if (i < s.size() && (s[i] == '+' || s[i] == '-')) ++i;
    const std::size_t start = i;
    while (i < s.size() && is_digit(s[i])) ++i;
    if (i == start) return std::nullopt;
  }
  if (i != s.size()) return std::nullopt;
  const std::string_view digits = whole.starts_with('+') ? whole.substr(1) : whole;
  double v = 0;
  const auto end = std::from_chars(digits.data(), digits.data() + digits.size(), v);
  if (end.ec != std::errc{} || end.ptr != digits.data() + digits.size() || !std::isfinite(v)) return std::nullopt;
  return v;
}

std::optional<std::int64_t> parse_integer(std::string_view s) {
  const bool negative = s.starts_with('-');
  if (negative) s.remove_prefix(1);
  if (negative && s.starts_with('+')) return std::nullopt;
  const auto magnitude = parse_unsigned(s);
  if (!magnitude) return std::nullopt;
  constexpr auto most = static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max());
  if (*magnitude > most) return std::nullopt;
  return negative ? -static_cast<std::int64_t>(*magnitude) : static_cast<std::int64_t>(*magnitude);
}

std::optional<double> parse_infinity(std::string_view s) {
  const bool negative = s.starts_with('-');
  if (negative || s.starts_with('+')) s.remove_prefix(1);
  if (s.starts_with('.')) s.remove_prefix(1);
  if (s != "inf" && s != "Inf") return std::nullopt;
  return negative ? -std::numeric_limits<double>::infinity() : std::numeric_limits<double>::infinity();
}

// A number such as "012" is 10 in YAML 1.1, but people read it as 12. The hint explains how to write the number.
std::string_view number_hint(std::string_view s) {
  if (s.starts_with('+') || s.starts_with('-')) s.remove_prefix(1);
  if (s.size() > 1 && s[0] == '0' && is_digit(s[1])) return "; remove the leading zero";
  if (s.starts_with("0x") || s.starts_with("0o") || s.starts_with("0b")) return "; write it in decimal";
  if (s.find('_') != std::string_view::npos) return "; write it without _";
  if (s.find(',') != std::string_view::npos) return "; the decimal sign is a point";
  return "";
}

}  // namespace sonar::text
