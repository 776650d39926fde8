#include "core/motion/stamp.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstddef>

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

namespace {

constexpr int in_seconds = 9, in_milliseconds = 6, in_microseconds = 3, in_nanoseconds = 0;

/// Median of the steps that rise; 0 if there are none.
double usual_step(const std::vector<double>& stamps) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < stamps.size(); ++i)
    if (stamps[i] > stamps[i - 1]) steps.push_back(stamps[i] - stamps[i - 1]);
  if (steps.empty()) return 0;
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  return *middle;
}

/// Metres per unit of the stamps.
double speed_of(const FirstLines& lines) {
  double way_m = 0;
  for (std::size_t i = 1; i < lines.positions.size(); ++i) way_m += length(lines.positions[i] - lines.positions[i - 1]);
  const double time = lines.stamps.back() - lines.stamps.front();
  return time > 0 ? way_m / time : 0;
}

}  // namespace

int unit_by_steps(const FirstLines& lines, int usual) {
  const double step = usual_step(lines.stamps);
  if (step == 0) return usual;
  const double speed = speed_of(lines);
  if (usual == in_nanoseconds) {
    constexpr double least_step_ns = 5e5;  // 2000 lines a second
    constexpr double least_since_1970_ns = 1e17;
    if (step >= least_step_ns || lines.stamps.front() >= least_since_1970_ns) return usual;
    return step < 5 ? in_seconds : step < 1000 ? in_milliseconds : in_microseconds;
  }
  constexpr double longest_step_s = 4, longest_wait_s = 1e5, slowest_m_s = 0.005, fastest_m_s = 20;
  const auto moves = [&](double units_in_a_second) {
    return speed * units_in_a_second >= slowest_m_s && speed * units_in_a_second <= fastest_m_s;
  };
  constexpr std::size_t lines_of_a_log = 10;  // a file that was written by hand for a resting body has fewer lines
  const bool is_log = lines.stamps.size() >= lines_of_a_log;
  const bool waits = speed == 0 && !is_log && step < longest_wait_s;
  if (step <= longest_step_s || waits || speed >= slowest_m_s) return usual;
  const bool logs_rest = is_log && speed * 1e3 < slowest_m_s;
  if (step < 1000) return moves(1e3) || logs_rest ? in_milliseconds : usual;
  if (step < 5000) return moves(1e3) || speed == 0 ? in_milliseconds : in_microseconds;
  return step < 1e6 || (step < 1e7 && moves(1e6)) ? in_microseconds : in_nanoseconds;
}

}  // namespace sonar::motion
