// Keeps what an oracle of docs/acoustics.md measured beside what it expects: tests call these instead of EXPECT_NEAR and the
// like. tests/oracles/oracle_table.py makes the summary table of the records that a test run leaves.
#pragma once

#include <string>

namespace sonar::test {

/// Line of a test that records something; std::source_location is not in clang 14.
struct Place {
  const char* file;
  int line;
};

/// Checks beyond the 46 of the table are recorded under this number, distinguished by `what`.
inline constexpr int no_number = 0;

/// Fails the running test unless |measured - expected| <= tolerance, and appends the figures to the folder that the environment
/// variable SONARD_ORACLES names (none: nothing is written). Of many records with one number and one `what` the table shows the
/// worst, so a loop may record every step. `number`: 1..46 or no_number. `unit`: as in "dB", empty for plain ratios.
void record_oracle(int number, const std::string& what, double expected, double measured, double tolerance,
                   const std::string& unit, Place where = {__builtin_FILE(), __builtin_LINE()});
/// The same for a one-sided bound: measured >= bound.
void record_at_least(int number, const std::string& what, double bound, double measured, const std::string& unit,
                     Place where = {__builtin_FILE(), __builtin_LINE()});
/// measured < bound.
void record_below(int number, const std::string& what, double bound, double measured, const std::string& unit,
                  Place where = {__builtin_FILE(), __builtin_LINE()});

}  // namespace sonar::test
