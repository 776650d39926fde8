// Reads time stamps from text, exact to the nanosecond; a double would round UNIX times to a quarter of a microsecond.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace sonar::motion {

/// Largest absolute value of a stamp [ns]: 146 years. With it, differences cannot overflow.
inline constexpr std::int64_t farthest_stamp_ns = 4'600'000'000'000'000'000;

/// Reads decimal text [s], rounded to the nearest nanosecond: "1403636579.763555584", "1.40363657976e+09", "-2".
std::optional<std::int64_t> nanoseconds_of_seconds(std::string_view text);
/// Reads a number in units of 10^`power` ns; 6 means milliseconds.
std::optional<std::int64_t> nanoseconds_of(std::string_view text, int power);
/// Reads whole nanoseconds: "1403636579763555584" or, as some programs write them, "1.403636579763555584e+18".
std::optional<std::int64_t> nanoseconds_of_nanoseconds(std::string_view text);

}  // namespace sonar::motion
