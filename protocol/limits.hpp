// Texts with which all makes refuse settings. The texts have the names and units of SettingsOverride, and the protocol's field in
// brackets.
#pragma once

#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>

#include "core/base/result.hpp"
#include "core/text/format.hpp"
#include "protocol/dialogue.hpp"

namespace sonar::protocol {

inline tl::unexpected<Error> refused(std::string text) { return failure(ErrorKind::usage, std::move(text)); }

/// Tolerance of limits of ranges: a double cannot hold most decimal fractions, so 0.3 - 0.2 is less than 0.1.
inline constexpr double rounding_m = 1e-5;

/// Returns the refusal of a range, such as "the range of a Surveyor is 0.01 to 200 m, not 400 m (end_mm)"; empty if `range_m` is
/// from `low_m` to `high_m`. `of`: the sonar, such as "a Surveyor".
inline std::string range_complaint(double range_m, std::string_view of, double low_m, double high_m,
                                   std::string_view field = {}) {
  if (range_m >= low_m - rounding_m && range_m <= high_m + rounding_m) return {};
  return "the range of " + std::string(of) + text::format(" is %.4g to %.4g m, not %g m", low_m, high_m, range_m) +
         (field.empty() ? std::string() : " (" + std::string(field) + ")");
}

/// The same for the range of a request; empty if it has none.
inline std::string range_complaint(const SettingsOverride& wanted, std::string_view of, double low_m, double high_m,
                                   std::string_view field = {}) {
  return wanted.range_m ? range_complaint(*wanted.range_m, of, low_m, high_m, field) : std::string();
}

/// Returns the first text that is not empty; if there is none, an empty text.
inline std::string first_of(std::initializer_list<std::string> complaints) {
  for (const std::string& one : complaints)
    if (!one.empty()) return one;
  return {};
}

/// Returns the refusal of the range in a message, such as "the range must start at 0 m or later, be at least 1 m long and end by
/// 142 m (length_mm)". `fields`: those of the message.
inline std::string range_rule(double least_m, double farthest_m, std::string_view fields) {
  return text::format("the range must start at 0 m or later, be at least %g m long and end by %g m (", least_m, farthest_m) +
         std::string(fields) + ")";
}

/// Returns the refusal of gain_percent; empty if it is valid or not set.
inline std::string gain_complaint(const SettingsOverride& wanted) {
  if (!wanted.gain_percent || (*wanted.gain_percent >= 0 && *wanted.gain_percent <= 100)) return {};
  return text::format("the gain must be 0 to 100 %%, not %g %% (gain_percent)", *wanted.gain_percent);
}

/// Returns the refusal of a rate by a sonar that has a standby; empty if the rate is valid or not set.
inline std::string rate_complaint(const SettingsOverride& wanted) {
  if (!wanted.rate_hz || *wanted.rate_hz >= 0) return {};
  return text::format("the rate must be 0 Hz (standby) or above, not %g Hz (rate_hz)", *wanted.rate_hz);
}
/// Returns the refusal of a rate by a sonar with a highest rate, such as "the rate of a Norbit is 0 to 60 Hz, not 70 Hz
/// (set_rate)".
inline std::string rate_complaint(const SettingsOverride& wanted, std::string_view of, float fastest_hz,
                                  std::string_view field = {}) {
  const double fastest = static_cast<double>(fastest_hz);
  if (!wanted.rate_hz || *wanted.rate_hz <= fastest) return rate_complaint(wanted);
  return "the rate of " + std::string(of) + text::format(" is 0 to %.4g Hz, not %g Hz", fastest, *wanted.rate_hz) +
         (field.empty() ? std::string() : " (" + std::string(field) + ")");
}

}  // namespace sonar::protocol
