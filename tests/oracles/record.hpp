// Keeps the measured and the expected values of the oracles of docs/acoustics.md. Tests call these functions instead of
// EXPECT_NEAR and similar macros. tests/oracles/oracle_table.py makes the summary table from the records of a test run.
#pragma once

#include <string>

namespace sonar::test {

/// Line of a test that records a value. clang 14 has no std::source_location.
struct Place {
  const char* file;
  int line;
};

/// Checks beyond the 46 of the table are recorded with this number and distinguished by `what`.
inline constexpr int no_number = 0;

/// Fails the running test unless |measured - expected| <= tolerance. Appends the figures to the folder in the environment
/// variable SONARD_ORACLES; without it, nothing is written. Of several records with the same number and `what`, the table shows
/// the worst, so a loop may record every step. `number`: 1..46 or no_number. `unit`: as in "dB", empty for plain ratios.
void record_oracle(int number, const std::string& what, double expected, double measured, double tolerance,
                   const std::string& unit, Place where = {__builtin_FILE(), __builtin_LINE()});
/// Does the same for a lower bound: measured >= bound.
void record_at_least(int number, const std::string& what, double bound, double measured, const std::string& unit,
                     Place where = {__builtin_FILE(), __builtin_LINE()});
/// Does the same for an upper bound: measured < bound.
void record_below(int number, const std::string& what, double bound, double measured, const std::string& unit,
                  Place where = {__builtin_FILE(), __builtin_LINE()});

}  // namespace sonar::test
