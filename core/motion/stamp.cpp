#include "core/motion/stamp.hpp"

#include <charconv>

namespace sonar::motion {
namespace {

constexpr int most_digits = 18;  // every number with at most this many decimal digits fits in a signed 64-bit integer
constexpr int second = 9;        // a second is 10^9 ns

bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// 10^n; n from 0 to most_digits.
std::uint64_t power_of_ten(int n) {
  std::uint64_t v = 1;
  while (n-- > 0) v *= 10;
  return v;
}

/// A number and its power of ten. Digits after the nineteenth are not needed here.
struct Digits {
  std::uint64_t number = 0;
  int exponent = 0, count = 0;

  void take(char digit, bool fraction) {
    // Leading zeros only shift the decimal point. They do not count among the nineteen digits.
    if (count == 0 && digit == '0') {
      exponent -= fraction;
      return;
    }
    // Nineteen digits always fit an unsigned 64-bit integer. Later digits are dropped; each one before the decimal point raises
    // the exponent by one.
    if (count <= most_digits) {
      number = number * 10 + static_cast<std::uint64_t>(digit - '0');
      ++count;
      exponent -= fraction;
    } else {
      exponent += !fraction;
    }
  }
  /// Multiplies by a power of ten and rounds half up; nullopt if the result exceeds the limit of a stamp.
  std::optional<std::int64_t> scaled(int shift) const {
    // The value is number * 10^by.
    const int by = exponent + shift;
    if (number == 0 || by < -most_digits - 1) return 0;
    if (by > most_digits) return std::nullopt;
    if (by < 0) {
      // 10^19 fits 64 bits unsigned, 10^20 does not.
      const std::uint64_t unit = by < -most_digits ? power_of_ten(most_digits) * 10 : power_of_ten(-by);
      // Rounds half up, without a sum that could overflow.
      const std::uint64_t rounded = number / unit + (number % unit >= unit - number % unit ? 1 : 0);
      return rounded > farthest_stamp_ns ? std::nullopt : std::optional(static_cast<std::int64_t>(rounded));
    }
    const std::uint64_t unit = power_of_ten(by);
    // The comparison uses a division, because the product could overflow.
    if (number > static_cast<std::uint64_t>(farthest_stamp_ns) / unit) return std::nullopt;
    return static_cast<std::int64_t>(number * unit);
  }
};

std::optional<std::int64_t> scaled_number(std::string_view text, int shift) {
  const bool negative = text.starts_with('-');
  if (negative || text.starts_with('+')) text.remove_prefix(1);
  Digits digits;
  std::size_t i = 0, seen = 0;
  for (; i < text.size() && is_digit(text[i]); ++i, ++seen) digits.take(text[i], false);
  if (i < text.size() && text[i] == '.')
    for (++i; i < text.size() && is_digit(text[i]); ++i, ++seen) digits.take(text[i], true);
  if (seen == 0) return std::nullopt;
  if (i < text.size() && (text[i] == 'e' || text[i] == 'E')) {
    // from_chars accepts a minus sign but no plus sign; "+-" is not a sign.
    if (++i < text.size() && text[i] == '+' && ++i < text.size() && text[i] == '-') return std::nullopt;
    int exponent = 0;
    const auto end = std::from_chars(text.data() + i, text.data() + text.size(), exponent);
    // These limits on the text and the exponent keep their sum within an int.
    if (end.ec != std::errc{} || exponent < -1000 || exponent > 1000 || text.size() > 1000) return std::nullopt;
    digits.exponent += exponent;
    i = static_cast<std::size_t>(end.ptr - text.data());
  }
  if (i != text.size()) return std::nullopt;
  const auto magnitude = digits.scaled(shift);
  if (!magnitude) return std::nullopt;
  return negative ? -*magnitude : *magnitude;
}

}  // namespace

std::optional<std::int64_t> nanoseconds_of(std::string_view text, int power) { return scaled_number(text, power); }
std::optional<std::int64_t> nanoseconds_of_seconds(std::string_view text) { return scaled_number(text, second); }
std::optional<std::int64_t> nanoseconds_of_nanoseconds(std::string_view text) { return scaled_number(text, 0); }

}  // namespace sonar::motion
