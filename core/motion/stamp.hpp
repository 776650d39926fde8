// Reads time stamps from text, exact to the nanosecond; a double would round UNIX times to a quarter of a microsecond.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "core/base/geometry.hpp"

namespace sonar::motion {

/// Largest absolute value of a stamp [ns]: 146 years. With it, differences cannot overflow.
inline constexpr std::int64_t farthest_stamp_ns = 4'600'000'000'000'000'000;

/// Reads decimal text [s], rounded to the nearest nanosecond: "1403636579.763555584", "1.40363657976e+09", "-2".
std::optional<std::int64_t> nanoseconds_of_seconds(std::string_view text);
/// Reads a number in units of 10^`power` ns; 6 means milliseconds.
std::optional<std::int64_t> nanoseconds_of(std::string_view text, int power);
/// Reads whole nanoseconds: "1403636579763555584" or, as some programs write them, "1.403636579763555584e+18".
std::optional<std::int64_t> nanoseconds_of_nanoseconds(std::string_view text);

// Guesses the unit of time stamps if the file does not name it, from the steps between stamps and from the resulting speed.

/// The first lines of one body: the stamps, in an unknown unit, and the positions [m].
struct FirstLines {
  std::vector<double> stamps;
  std::vector<Vec3d> positions;
};

/// Returns the power N of the unit 10^N ns: 9, 6, 3 or 0. `usual` is the N of the file's format: 9 (seconds) or 0 (nanoseconds).
/// The result is `usual`, unless nanoseconds would mean implausibly short steps, or seconds would mean steps above 4 s of a body
/// slower than 5 mm/s. If the body rests, a file of ten or more lines is assumed to be a log, whose steps are short.
int unit_by_steps(const FirstLines& lines, int usual);

}  // namespace sonar::motion
